"""A run as one HTML file that opens without network: pages, tables, drawings and plots."""
