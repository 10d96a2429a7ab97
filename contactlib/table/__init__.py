"""Tables of a law: building, reading, and the certificate of their error."""
