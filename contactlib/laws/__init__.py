"""The creep force laws and what they need: contact, friction, heat, measured curves, fits."""
