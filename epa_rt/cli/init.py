"""Write a workspace: the rigs, experiments, plants, studies and mappings that come with epa.

They go into DIR/config, where the examples of every help look for them. A file that is there
already stays as it is.

  epa init bench
  epa init .
"""

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, FAILED, VerbError
from epa_rt.cli.write import cannot_write

_NOT_OURS = (".zero.yaml", ".state.json")  # what runs leave beside the files of a rig


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("folder", type=Path, metavar="DIR", help="folder, made where it is not there")


def main(arguments: argparse.Namespace) -> int:
    config = arguments.folder / "config"
    written, kept, changed = 0, 0, []
    for name, content in packaged():
        path = config / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if _made(path, content):
                written += 1
            elif path.is_file() and path.read_bytes() == content:
                kept += 1
            else:
                changed.append(path)
        except OSError as error:
            raise cannot_write(path, error) from None
    same = f", {kept} were there already" if kept else ""
    print(f"{config}: {written} files written{same}")
    for path in changed:
        print(f"kept, though it differs: {path}")
    lead = "" if arguments.folder == Path(".") else f"cd {arguments.folder} && "
    print(f"next: {lead}epa check config/rigs/bench.yaml")
    return COMPLETED


def packaged() -> Iterator[tuple[Path, bytes]]:
    """The files that come with this package, by name within config. Raises VerbError where they are
    not there.
    """
    root = packaged_root()
    for path in sorted(root.rglob("*")):
        if path.is_file() and not path.name.endswith(_NOT_OURS) and path.name[:1] != ".":
            yield path.relative_to(root), path.read_bytes()


def packaged_root() -> Path:
    """The folder of a wheel, else that of the checkout. Raises VerbError."""
    package = Path(__file__).resolve().parents[1]
    for root in (package / "workspace", package.parent / "config"):
        if (root / "rigs").is_dir():
            return root
    raise VerbError(
        f"{package}: found no files to write, expected a wheel that carries them, or a checkout",
        FAILED,
    )


def _made(path: Path, content: bytes) -> bool:
    """Writes a file that is not there, all of it or nothing; False where there is one."""
    if path.exists() or path.is_symlink():
        return False
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_bytes(content)
        os.link(part, path)  # refuses a name that somebody took meanwhile
    except FileExistsError:
        return False
    finally:
        part.unlink(missing_ok=True)
    return True
