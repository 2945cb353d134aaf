"""Distances between bodies: shapes of the links, smooth closed forms for the search, coal for the judge."""
