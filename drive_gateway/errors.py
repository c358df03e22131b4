"""What can go wrong with a gateway, for people."""


class GatewayError(Exception):
    """Root of what a gateway and its simulated drives raise."""
