"""The stress suite: hard and odd situations, each judged right, refused, flagged, or wrong (docs/stress.md)."""
