"""The result, which recomputes everything about itself."""
