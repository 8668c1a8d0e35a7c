"""The commands of ``femgear``, in a module for each kind of work; `femgear.cli` loads them.

A command is a function under ``@app.command``: its signature makes the options, its docstring the help.
"""

INTERRUPTED = 130
"""Exit code of a command that Ctrl-C or SIGTERM ended."""
LOADING = "install femgear with its libraries; where memory is limited (ulimit -v, -d), raise the limit"
"""Remedy where a library cannot be loaded."""
