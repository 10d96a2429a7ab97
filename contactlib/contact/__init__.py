"""The creep force of one contact: Hertz, friction, laws, table, kernel, force element."""
