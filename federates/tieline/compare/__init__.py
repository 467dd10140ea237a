"""Looks at results side by side: their figures, their settings, and what they recorded."""
