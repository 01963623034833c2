"""Who may connect to a viewer: those who know its token, by one of the server's own addresses, from its own page."""

from __future__ import annotations

import base64
import contextlib
import hmac
import ipaddress
import os
import re
import secrets
import urllib.parse

from ..base.parameters import check_type

#: The environment variable with a token.
TOKEN_VARIABLE = "ISOSPLINE_TOKEN"


class Access:
    """The token of a server, and checks of requests.

    An address with the token opens the page, which gets a cookie in exchange. Cookies do not distinguish ports, so
    each port has its own name. The cookie's value does not tell the token. Tokens are compared in constant time.

    Parameters
    ----------
    host : str
        The address that the server listens on.
    token : str or None
        For None, that of the environment variable ISOSPLINE_TOKEN, or a random one.

    Attributes
    ----------
    token : str
    """

    def __init__(self, host, token):
        check_type(token, "token", (str, type(None)), "a str or None")
        given = token if token is not None else os.environ.get(TOKEN_VARIABLE) or None
        if given is not None and not re.fullmatch("[!-~]+", given):  # the message must not show it
            name = TOKEN_VARIABLE if token is None else "token"
            raise ValueError(f"{name}: expected ASCII characters without spaces, at least one, got others or none")
        self._host = host
        self.token = given or secrets.token_urlsafe(24)

    def is_own_address(self, host):
        """Whether the header Host names the server by an IP address, or by the name that it listens on.

        Other names could be domains that an attacker points to this machine in order to read its pages with a
        browser's cookies (DNS rebinding).
        """
        with contextlib.suppress(ValueError):
            name = urllib.parse.urlsplit(f"//{host}").hostname or ""
            if name == "localhost" or name == self._host:
                return True
            address = ipaddress.ip_address(name)
            return address.is_loopback or not is_local(self._host)
        return False

    def is_own_page(self, origin, host):
        """Whether a page of the server sent a request with the headers Origin and Host."""
        return origin in (f"http://{host}", f"https://{host}")

    def knows_token(self, query):
        """Whether the query of an address has the token."""
        return _same(urllib.parse.parse_qs(query).get("token", [""])[0], self.token)

    def has_cookie(self, cookies, port):
        """Whether one of the headers Cookie has the cookie of a port."""
        name, value = self._cookie(port)
        pairs = (each.strip().partition("=") for header in cookies for each in header.split(";"))
        return any(_same(given, value) for key, _, given in pairs if key == name)

    def set_cookie(self, port):
        """The header Set-Cookie. Scripts cannot read the cookie, and requests of other sites do not have it."""
        return "{}={}; Path=/; HttpOnly; SameSite=Strict".format(*self._cookie(port))

    def _cookie(self, port):
        digest = hmac.digest(self.token.encode(), f"cookie of the isospline viewer at port {port}".encode(), "sha256")
        return f"isospline-{port}", base64.urlsafe_b64encode(digest[:18]).decode()


def _same(given, secret):
    return hmac.compare_digest(given.encode(errors="replace"), secret.encode())


def is_local(host):
    """Whether only this machine can connect to an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
