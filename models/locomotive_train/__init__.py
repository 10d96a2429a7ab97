"""A four-axle locomotive with its train in Exudyn; `README.md` describes its purpose."""
