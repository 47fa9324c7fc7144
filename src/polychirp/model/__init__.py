"""The nouns: small immutable data types through which the stages speak to each other."""
