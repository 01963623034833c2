"""What a picture of a volume shows if nothing is said: pieces, and a view from the front with the top above."""
