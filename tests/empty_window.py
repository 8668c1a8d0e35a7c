"""A window without a browser, in which a test puts widgets."""

import contextlib


@contextlib.contextmanager
def empty_window():
    """Have widgets drawn in a window that nobody sees."""
    from nicegui import Client
    from nicegui.page import page

    with Client(page("/test"), request=None) as client:
        yield client
    client.delete()
