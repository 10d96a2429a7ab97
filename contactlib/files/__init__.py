"""Model and scenario files: TOML is read into validated, frozen parameters."""
