"""A diagnosis as a page for people: self-contained, on any screen and on paper."""
