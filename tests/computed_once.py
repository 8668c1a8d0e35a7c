"""What the workers of pytest compute once for all of them, kept in a folder by the content of arguments."""

import hashlib
import os
import pickle
import threading
from functools import wraps


def kept(function, folder):
    """The function, whose results for the same arguments are read from the folder, if there is one.

    For pure functions alone. Every call has a copy of its own; arguments count as the same where they are
    pickled to the same bytes.
    """
    if folder is None:
        return function

    @wraps(function)
    def found(*arguments, **options):
        words = pickle.dumps((function.__module__, function.__qualname__, arguments, options))
        path = folder / hashlib.sha256(words).hexdigest()
        if not path.exists():
            # another worker may do the same now
            new = path.with_name(f"{path.name}.{os.getpid()}.{threading.get_ident()}")
            new.write_bytes(pickle.dumps(function(*arguments, **options)))
            new.replace(path)
        return pickle.loads(path.read_bytes())

    return found
