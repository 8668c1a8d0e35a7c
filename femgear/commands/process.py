"""The process of a command line: signals, standard streams, and errors as exit codes."""

from __future__ import annotations

import _thread
import atexit
import contextlib
import gc
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cyclopts import App, CycloptsError, MissingArgumentError

from femgear.commands import INTERRUPTED, LOADING
from femgear.commands.terminal import print_warnings, warning_lines
from femgear.errors import CaseError, FemgearError, printable
from femgear.findings import FindingWarning
from femgear.storage.disk_errors import noted_interrupts, storage_error

_RARELY = 50_000
"""New objects after which garbage is looked for: more than by default, since what a run makes is kept."""


def call(program_app: App, arguments: Sequence[str] | None, *, program: str) -> int:
    """Call a program as `main` does, its warnings and errors as lines on standard error; remedies name it."""
    if arguments is None:  # a process of its own
        gc.set_threshold(_RARELY)
    for descriptor in range(3):  # a file that takes the number of a closed one would hold what is printed
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if len(os.environ.get("COLUMNS", "80").lstrip("0")) < 2:  # rich fails or never ends in a few columns
        del os.environ["COLUMNS"]
    output, errors = _Stream(sys.stdout), _Stream(sys.stderr)
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        code = _called(program_app, sys.argv[1:] if arguments is None else list(arguments), program)
        with _handlers({signal.SIGINT: signal.SIG_IGN}):  # all is done but to show it
            output.flush()
            # a reader that has seen enough is no failure
            if code == 0 and output.error and not isinstance(output.error, BrokenPipeError):
                failure = storage_error(output.error, "standard output")
                failure.remedy = "free some space where it goes, or send it elsewhere"
                code = _fail(failure)
            errors.flush()
    if arguments is None:  # when the process ends, nothing is left to interrupt but the interpreter
        for number in (signal.SIGINT, signal.SIGTERM):
            atexit.register(signal.signal, number, signal.SIG_IGN)
    return code


class _Stream:
    """Standard stream that escapes what its encoding lacks, and keeps the failure to write in ``error``."""

    def __init__(self, stream):
        self._stream, self.error = stream or open(os.devnull, "w", encoding="utf-8"), None

    def __getattr__(self, name: str):
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        encoding = self._stream.encoding or "utf-8"
        self._try(self._stream.write, text.encode(encoding, "backslashreplace").decode(encoding))
        return len(text)

    def flush(self) -> None:
        self._try(self._stream.flush)

    def _try(self, function, *arguments) -> None:
        try:
            function(*arguments)
        except OSError as error:
            self.error = self.error or error
            # what the buffer holds would fail again when the interpreter ends
            with contextlib.suppress(OSError), open(os.devnull, "wb") as nothing:
                os.dup2(nothing.fileno(), self._stream.fileno())


def _called(program_app: App, tokens: list[str], program: str) -> int:
    """Exit code of a program, its errors told."""
    try:
        with warnings.catch_warnings(), _termination_interrupts():
            warnings.showwarning = _show_warning
            result = program_app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        return result if isinstance(result, int) else 0
    except CycloptsError as error:
        return _fail(_wrong_arguments(error, program))
    except FemgearError as error:
        return _fail(error)
    except KeyboardInterrupt as interrupt:
        print(printable("; ".join(["interrupted", *getattr(interrupt, "__notes__", [])])), file=sys.stderr)
        return INTERRUPTED
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "new thread" not in str(error):
            raise
        return _fail(
            FemgearError(
                f"the memory of this machine does not suffice: {error}".removesuffix(": "),
                code="E-MEMORY",
                remedy="ask for fewer speeds, positions, harmonics or elements",
            )
        )
    except ValueError as error:
        from numpy.linalg import LinAlgError  # late: help is shown without numpy

        if not isinstance(error, LinAlgError):
            raise
        remedy = "look for masses, stiffnesses or dimensions of very different size"
        return _fail(FemgearError(f"equations cannot be solved: {error}", code="E-SOLVE", remedy=remedy))
    except ImportError as error:
        message = f"a library cannot be loaded: {' '.join(str(error).split())}"
        return _fail(FemgearError(message, code="E-LIBRARY", remedy=LOADING))
    except OSError as error:
        return _fail(storage_error(error, error.filename))


def _fail(error: FemgearError) -> int:
    if error.key in ("only", "speeds"):
        error.key = f"--{error.key}"
    print(error, file=sys.stderr)
    return error.exit_code


def _wrong_arguments(error: CycloptsError, program: str) -> CaseError:
    """Tell what is wrong with a command line, in one sentence."""
    absent = isinstance(error, MissingArgumentError) and not (error.argument and error.argument.tokens)
    message = " ".join(str(error).split())
    if absent and error.argument is not None and "--" + error.argument.name.lstrip("-") not in _given(error):
        message = f"{error.argument.name} is required"
    command = " ".join((program, *(error.command_chain or ())))
    remedy = f"{command} --help" + "; other entries are written into the file" * command.endswith(" new")
    return CaseError(message, code="E-ARGUMENTS", remedy=remedy)


def _given(error: CycloptsError) -> list[str]:
    """Arguments as typed; ``-o`` counts as ``--output``."""
    return ["--output" if token == "-o" else token for token in error.root_input_tokens or ()]


def _show_warning(message, category, filename, lineno, file=None, line=None) -> None:
    """Print a warning on standard error as a finding; takes the place of `warnings.showwarning`.

    Those of other libraries say where they come from.
    """
    ours = issubclass(category, FindingWarning) or category is UserWarning
    warned = message if ours else f"{message} ({category.__name__}, {filename}:{lineno})"
    print_warnings(warning_lines([warned], whole=True))


@contextlib.contextmanager
def _termination_interrupts() -> Iterator[None]:
    """End the block by SIGTERM as by Ctrl-C, so that files stay whole and locks are released."""
    hook = sys.unraisablehook

    def again(lost: Any) -> None:
        # Python drops what is raised while it clears an object up: the interrupt comes once more
        if issubclass(lost.exc_type, KeyboardInterrupt):
            threading.Timer(0.02, _thread.interrupt_main).start()
        else:
            hook(lost)

    with noted_interrupts() as interrupt:
        caught = [signal.SIGTERM]
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored on purpose
            caught.append(signal.SIGINT)
        with _handlers(dict.fromkeys(caught, interrupt)):
            sys.unraisablehook = again
            try:
                yield
            finally:
                sys.unraisablehook = hook


@contextlib.contextmanager
def _handlers(handlers: Mapping[signal.Signals, Any]) -> Iterator[None]:
    """Handle signals so in the block; in the main thread alone, where they arrive."""
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()} if main else {}
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)
