"""The sources of a store's samples."""
