"""Compilation of numba kernels ahead of their use, in parallel, into the cache on disk.

A program that compiles kernels one after another on their first use is slow when it runs for the
first time. Here worker processes compile all kernels first, and the program itself only loads them.

Kernels are compiled in parts: a worker calls the Python functions of a part once, on small data.
Numba finds by itself which kernels and types these functions need. A stamp file in the cache folder
says which parts are there, so that a later start costs some milliseconds.
"""

import ast
import atexit
import gc
import hashlib
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any, Final, cast

from polychirp.file_locks import try_to_lock, wait_for_lock
from polychirp.threads import num_cores

PACKAGE: Final = Path(__file__).parent
"""Folder of the sources whose kernels are compiled."""

ANNOUNCED: Final = 5.0
"""Estimated duration of a compilation, s, above which it is announced on stderr (chosen)."""

MOST_WORKERS: Final = 8
"""Greatest number of worker processes. Chosen: each takes up to 1 GB, and there are few parts."""

Progress = Callable[[str, int, int], None]
"""Callback with the name of a task, the number of its steps done, and their total."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Kernels that one worker compiles in one go.

    Parameters
    ----------
    name : name by which a worker is told to compile the part
    duration : approximate time of the compilation on one core, s
    kernels : approximate number of compiled kernels; each combination of argument types counts
    """

    name: str
    duration: float
    kernels: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Compiled:
    """Outcome of `compile_ahead`.

    Parameters
    ----------
    folder : folder of the stamp, and of all kernels unless numba keeps them beside their sources
    parts : names of the parts that workers finished, also with a failure; empty if none was missing
    kernels : names of the compiled kernels, once per combination of argument types
    duration : time that the compilation took, s
    failures : one sentence per worker that ended early, and per part that could not be compiled
    """

    folder: Path
    parts: tuple[str, ...] = ()
    kernels: tuple[str, ...] = ()
    duration: float = 0.0
    failures: tuple[str, ...] = ()


def is_enabled() -> bool:
    """False if numba is told not to compile (``NUMBA_DISABLE_JIT``)."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


@cache
def cache_folder() -> Path:
    """Folder of the stamp: the first of numba's cache folders that can be written.

    If none can be written, kernels go into a temporary folder that is deleted at the program's end,
    since numba refuses to define kernels that it cannot keep. A note on stderr says so. Call this
    function before kernels are imported.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and not _is_writable(Path(given)):
        _note(f"NUMBA_CACHE_DIR={given} cannot be written; kernels are kept elsewhere")
    for candidate in _candidates():
        if _is_writable(candidate):
            return candidate
    tried = ", ".join(map(str, _candidates()))
    folder = Path(tempfile.mkdtemp(prefix="polychirp-kernels-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    _note(
        f"no cache folder can be written ({tried}); kernels are compiled anew by every command; "
        "NUMBA_CACHE_DIR=FOLDER names a folder to keep them in"
    )
    return folder


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _candidates() -> Iterator[Path]:
    """Numba's cache folders in its order: the one given, beside the sources, the user's."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        yield Path(given)
    yield PACKAGE / "__pycache__"
    from numba.misc.appdirs import AppDirs  # here, since it is a slow import

    yield Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)  # type: ignore[no-untyped-call]


def _note(text: str) -> None:
    _say(f"note: {text}")


def _say(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamp:
    """Record of the parts that are in the cache.

    Parameters
    ----------
    sources : hash of the names, sizes and times of change of all sources (`source_hash`)
    modules : hash of the content behind every module with kernels (`kernel_modules`)
    parts : index files in numba's cache that the compilation of every finished part used
    """

    sources: str
    modules: Mapping[str, str]
    parts: Mapping[str, Sequence[str]]


def stamp_path() -> Path:
    """File of the stamp: one per folder of the package, interpreter, compiler and processor."""
    return cache_folder() / f"polychirp-{_machine()}.json"


@cache
def _machine() -> str:
    import llvmlite.binding as llvm  # type: ignore[import-untyped]

    options = {
        name: value
        for name, value in os.environ.items()
        if name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT", "NUMBA_BOUNDSCHECK")
    }
    key = [
        str(PACKAGE),
        platform.python_implementation(),
        platform.python_version(),
        version("numba"),
        version("llvmlite"),
        llvm.get_host_cpu_name(),
        llvm.get_host_cpu_features().flatten(),
        sorted(options.items()),
    ]
    return _hash(json.dumps(key))


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def source_hash() -> str:
    """Hash of the names, sizes and times of change of all sources of the package."""
    found = [(path, path.stat()) for path in PACKAGE.rglob("*.py")]
    return _hash(repr(sorted((str(p), stat.st_size, stat.st_mtime_ns) for p, stat in found)))


def read_stamp() -> Stamp | None:
    """The stamp on disk; None if there is none that can be read."""
    try:
        return Stamp(**json.loads(stamp_path().read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def _write_stamp(stamp: Stamp) -> None:
    path = stamp_path()
    with suppress(OSError):  # without a stamp, the next start asks workers for all parts
        fresh = path.with_suffix(f".{os.getpid()}")
        fresh.write_text(json.dumps(asdict(stamp), indent=1), encoding="utf-8")
        fresh.replace(path)


def missing(names: Sequence[str]) -> tuple[str, ...]:
    """Those of ``names`` whose parts the cache lacks; all if no stamp has the present sources."""
    stamp = read_stamp()
    if stamp is None or stamp.sources != source_hash():
        return tuple(names)
    return tuple(name for name in names if not _is_there(stamp.parts.get(name)))


def _is_there(files: Sequence[str] | None) -> bool:
    return files is not None and all(map(os.path.exists, files))


def _current_stamp() -> Stamp:
    """The stamp for the present sources; it has no parts if a module with kernels has changed.

    Numba looks at the file of a kernel alone, and overlooks a change of a function or a constant
    that the kernel takes from another file. So cache files of changed modules are deleted here,
    those that no part names too, since kernels are also compiled elsewhere.
    """
    sources, modules = source_hash(), kernel_modules()
    stamp = read_stamp() or Stamp(sources=sources, modules=modules, parts={})
    changed = {name for name in stamp.modules if stamp.modules[name] != modules.get(name)}
    if changed or len(modules) != len(stamp.modules):
        for path in _index_files(changed):
            path.unlink(missing_ok=True)
        return Stamp(sources=sources, modules=modules, parts={})
    current = replace(stamp, sources=sources)
    if stamp.sources != sources:
        _write_stamp(current)
    return current


def _index_files(modules: Iterable[str]) -> Iterator[Path]:
    """Index files of all kernels of modules in the folders in which numba may keep them."""
    from numba.core.caching import _CacheLocator  # here, since it is a slow import

    for module in modules:
        *packages, name = module.split(".")
        folder = PACKAGE.parent.joinpath(*packages)
        inner = _CacheLocator.get_suitable_cache_subpath(str(folder / f"{name}.py"))  # type: ignore[no-untyped-call]
        for place in (folder / "__pycache__", cache_folder() / inner):
            yield from place.glob(f"{name}.*.nbi")


def kernel_modules() -> dict[str, str]:
    """Hash of every module with kernels and of the modules whose kernels or constants it imports.

    Names in capitals are constants, which numba compiles into the kernels. A constant may be
    computed from those of further modules, which are therefore hashed as well.
    """
    texts = {}
    for path in PACKAGE.rglob("*.py"):
        inner = path.relative_to(PACKAGE.parent).with_suffix("").parts
        texts[".".join(inner).removesuffix(".__init__")] = path.read_text(encoding="utf-8")
    has_kernels = {name for name, text in texts.items() if _KERNEL_IMPORT.search(text)}
    own = {name: _hash(text) for name, text in texts.items()}

    @cache
    def taken(name: str) -> frozenset[str]:
        # a module without kernels gives its constants alone, and takes no kernels for them
        kernels = has_kernels if name in has_kernels else frozenset()
        return frozenset(
            module
            for module, symbols in _imports(texts[name])
            if module in kernels or (module in texts and any(map(str.isupper, symbols)))
        )

    return {
        name: _hash("".join(own[n] for n in sorted(_reach(name, taken)))) for name in has_kernels
    }


_KERNEL_IMPORT: Final = re.compile(r"^from (polychirp\.jit|numba[.\w]*) import\b", re.MULTILINE)
"""Import of a decorator of kernels or of the compiler, by which such a module is recognised."""


def _imports(text: str) -> Iterator[tuple[str, list[str]]]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module, [alias.name for alias in node.names]


def _reach(name: str, taken: Callable[[str], frozenset[str]]) -> set[str]:
    """The module ``name``, those that ``taken`` names for it, and those that it names for them."""
    reached, ahead = {name}, [name]
    while ahead:
        new = taken(ahead.pop()) - reached
        reached |= new
        ahead += new
    return reached


def compile_ahead(
    parts: Sequence[Part],
    *,
    worker: str,
    progress: Progress | None = None,
    announce: bool = True,
) -> Compiled:
    """Compile those parts that the cache does not have, in worker processes.

    Workers take the parts in the given order: parts whose kernels other parts call should come
    first. Programs that need the same kernels at the same time wait for each other. If a part or
    its worker fails, a note says so, and the missing kernels are compiled on their first use.

    Parameters
    ----------
    worker : name of the module that calls `serve`; it is run with ``python -m``
    progress : callback that is given the number of kernels compiled and their approximate total;
        the number is weighted with the durations of the parts, so that it grows evenly with time,
        and its rate so far tells when the compilation ends
    announce : true for a line on stderr before a wait or before an estimated `ANNOUNCED` s or more
    """
    names = [part.name for part in parts]
    if not (is_enabled() and missing(names)):
        return Compiled(folder=cache_folder())
    waiting = "polychirp: another program compiles the kernels; waiting for it" if announce else ""
    with _locked(stamp_path().with_suffix(".lock"), say=waiting):
        start = time.perf_counter()
        stamp = _current_stamp()
        wanted = [part for part in parts if not _is_there(stamp.parts.get(part.name))]
        if not wanted:
            return Compiled(folder=cache_folder())
        total = sum(part.kernels for part in wanted)
        if announce:
            _announce(wanted, total)
        kernels: list[tuple[str, str]] = []
        show = progress or (lambda *_: None)
        show("compiling kernels", 0, total)
        done, failures = {}, []
        for kind, value in _run(wanted, worker):
            if kind == "kernel":
                kernels.append(value)
            elif kind == "part":
                done[value["name"]] = value["files"]
            else:
                failures.append(value)
            counts = Counter(part for part, _ in kernels)
            share = _share_done(wanted, counts=counts, finished=done)
            show("compiling kernels", min(int(total * share), total - 1), total)
        show("compiling kernels", total, total)
        for failure in failures:
            _note(f"{failure}; the kernels are compiled where they are needed")
        _write_stamp(replace(stamp, parts={**stamp.parts, **done}))
        return Compiled(
            folder=cache_folder(),
            parts=tuple(done),
            kernels=tuple(kernel for _, kernel in kernels),
            duration=time.perf_counter() - start,
            failures=tuple(failures),
        )


def _announce(parts: Sequence[Part], total: int) -> None:
    duration = expected_duration(parts)
    if duration > ANNOUNCED:
        _say(f"polychirp: compiling {total} kernels, once; about {duration:.0f} s on free cores")


def expected_duration(parts: Sequence[Part]) -> float:
    """Time in which free cores compile parts, s; on a busy machine it takes a multiple of it.

    >>> expected_duration([])
    0.0
    """
    if not parts:
        return 0.0
    work = sum(part.duration for part in parts)
    return max(work / _num_workers(parts), *(part.duration for part in parts))


def _num_workers(parts: Sequence[Part]) -> int:
    return min(num_cores(), len(parts), MOST_WORKERS)


def _share_done(
    parts: Sequence[Part], *, counts: Mapping[str, int], finished: Container[str]
) -> float:
    """Share of the work that is done, after ``counts`` kernels of each part, by its name.

    A kernel takes as long as the others of its part, and a part that is not finished may have more
    of them than expected.

    >>> slow = Part(name="slow", duration=9.0, kernels=3)
    >>> quick = Part(name="quick", duration=1.0, kernels=3)
    >>> _share_done([slow, quick], counts={"slow": 1}, finished=["quick"])
    0.4
    """
    done = sum(
        part.duration
        if part.name in finished
        else part.duration * min(1.0, counts.get(part.name, 0) / part.kernels)
        for part in parts
    )
    return done / sum(part.duration for part in parts)


def _run(parts: Sequence[Part], worker: str) -> Iterator[tuple[str, Any]]:
    """Reports of the workers, by kind.

    They are "kernel" (with its part's name before its own), "part" (with its cache files) and
    "failure".
    """
    count = _num_workers(parts)
    ahead = deque(part.name for part in parts)
    news: SimpleQueue[tuple[str, Any] | None] = SimpleQueue()
    locks = tempfile.mkdtemp(prefix="polychirp-locks-")
    processes = [_started(worker, locks) for _ in range(count)]
    try:
        for process in processes:
            Thread(target=_employ, args=(process, ahead, news), daemon=True).start()
        while count:
            report = news.get()
            if report is None:
                count -= 1
            else:
                yield report
    finally:
        for process in processes:
            process.kill()
            process.wait()
        shutil.rmtree(locks, ignore_errors=True)


def _started(module: str, locks: str) -> subprocess.Popen[str]:
    """A worker that was started: a process of one thread that compiles one part after another."""
    paths = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    threads = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, locks],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **dict.fromkeys(threads, "1"), "PYTHONPATH": os.pathsep.join(paths)},
    )


def _employ(
    process: subprocess.Popen[str],
    ahead: deque[str],
    news: SimpleQueue[tuple[str, Any] | None],
) -> None:
    """Give a worker one part after another, and put its reports into ``news``; then put None."""
    orders, reports = cast("IO[str]", process.stdin), cast("IO[str]", process.stdout)
    try:
        # if no part is left, popleft raises IndexError, and the worker ends as its pipes are closed
        with suppress(IndexError, OSError), reports, orders:
            while True:
                name = ahead.popleft()
                with suppress(OSError):  # the worker died: below, no report arrives
                    print(name, file=orders, flush=True)
                row: dict[str, Any] = {}
                for line in reports:
                    row = json.loads(line) if line.endswith("\n") else {}
                    if "kernel" not in row:
                        break
                    news.put(("kernel", (name, row["kernel"])))
                if "files" not in row:
                    news.put(("failure", f"a worker ended while it compiled '{name}'"))
                    break
                if "failure" in row:
                    news.put(("failure", f"'{name}' could not be compiled ahead: {row['failure']}"))
                # a part that failed is not tried again before the sources change
                news.put(("part", {"name": name, "files": row["files"]}))
    finally:
        news.put(None)


def serve(parts: Mapping[str, Callable[[], None]]) -> None:
    """Run as a worker: names of parts come in on stdin, reports as JSON lines go out on stdout."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C: the starting program ends its workers
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)  # collecting numba's many objects took 1/16 of the time
    with os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8") as out:
        # text that a library prints goes to stderr, not among the reports
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

        def tell(**row: Any) -> None:
            print(json.dumps(row), file=out, flush=True)

        files: set[str] = set()
        _compile_each_once(Path(sys.argv[1]), files, lambda name: tell(kernel=name))
        for line in sys.stdin:
            files.clear()
            try:
                parts[line.strip()]()
            except Exception as error:  # the other parts are compiled nevertheless
                tell(
                    failure=f"{type(error).__name__}: {error}".splitlines()[0], files=sorted(files)
                )
            else:
                tell(files=sorted(files))


def _compile_each_once(locks: Path, files: set[str], tell: Callable[[str], None]) -> None:
    """Make numba wait while another worker compiles the same kernel, and then load the kernel."""
    from numba.core.caching import NullCache
    from numba.core.dispatcher import Dispatcher

    original = Dispatcher.compile

    def compile_once(self: Any, signature: Any) -> Any:
        cache = self._cache
        if isinstance(cache, NullCache):
            return original(self, signature)
        module, kernel = self.py_func.__module__, self.py_func.__qualname__
        index = str(Path(cache.cache_path) / cache._cache_file._index_name)
        with _locked(locks / _hash(index)):
            before = sum(self._cache_misses.values())
            entry = original(self, signature)
            if sum(self._cache_misses.values()) > before:
                tell(f"{module}.{kernel}")
        files.add(index)
        return entry

    Dispatcher.compile = compile_once  # type: ignore[method-assign, assignment]


_HELD_LOCKS: Final[set[Path]] = set()
"""Lock files that this process holds."""


@contextmanager
def _locked(path: Path, *, say: str = "") -> Iterator[None]:
    """Hold a lock file; print ``say`` on stderr if another process holds it and this one waits."""
    if path in _HELD_LOCKS:
        yield
        return
    with path.open("w") as file:
        if not try_to_lock(file):
            if say:
                _say(say)
            wait_for_lock(file)
        _HELD_LOCKS.add(path)
        try:
            yield
        finally:
            _HELD_LOCKS.remove(path)
