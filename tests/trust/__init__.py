"""Are results that cannot be trusted flagged for the right reason, and those that can be left alone?"""
