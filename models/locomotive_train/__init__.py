"""A four-axle locomotive with its train in Exudyn; `README.md` says what it is for."""
