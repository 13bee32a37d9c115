"""Questions to the library: what can be asked, in which words, and how a question becomes a function."""
