"""The model fused, with all derivatives by x = (q, w, δσ): what the search evaluates."""
