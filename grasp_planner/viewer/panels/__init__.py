"""The panels beside the picture: one file a panel."""
