"""Makes the pictures of the tutorials anew: follows each page, and copies what its commands have drawn.

    python3 pictures.py PREFIX [PAGE...]

PREFIX is where treeroll is installed. Screenshots of the page need Chromium; without it they stay as they are."""

import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from page import Picture, steps_of
from reader import Reader, own_network

TUTORIALS = Path(__file__).resolve().parents[2] / "deploy/doc/tutorials"
BROWSERS = ("/usr/bin/chromium", "/usr/bin/chromium-browser")


def photograph(browser: str, address: str, picture: Picture) -> None:
    """A screenshot of a page in a window of the size that the tutorial gives, "1200x800" or "1200x800 dark"."""
    size, *words = picture.how.split()
    with tempfile.TemporaryDirectory(prefix="treeroll-browser-") as profile:
        subprocess.run(
            [browser, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
             f"--user-data-dir={profile}", f"--window-size={size.replace('x', ',')}",
             f"--blink-settings=preferredColorScheme={0 if 'dark' in words else 1}",
             # The page's clock runs ahead: what it does in these ms is on the picture.
             "--virtual-time-budget=8000", f"--screenshot={picture.path}", address],
            check=True, timeout=120, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def photograph_journal(prefix: Path, browser: str, state: Path, picture: Picture) -> None:
    """A screenshot of the page of a state directory."""
    replay = subprocess.Popen([prefix / "bin/treeroll-replay", state, "--http", "0"], text=True,
                              stderr=subprocess.PIPE)
    try:
        address = next(found[0] for line in replay.stderr if (found := re.search(r"http://\S+", line)))
        threading.Thread(target=replay.stderr.read, daemon=True).start()
        photograph(browser, address, picture)
        time.sleep(3)  # the best roll-out is simulated once more, in the time of the world
        photograph(browser, address, picture)
    finally:
        replay.terminate()
        replay.wait()


def pages_with_pictures():
    return sorted(path.stem for path in TUTORIALS.glob("*.md")
                  if any(isinstance(step, Picture) for step in steps_of(path)))


def main() -> None:
    prefix = Path(sys.argv[1]).resolve()
    browser = next((path for path in BROWSERS if Path(path).exists()), None)
    for name in sys.argv[2:] or pages_with_pictures():
        made = []

        def see(picture: Picture, source: Path) -> None:
            picture.path.parent.mkdir(exist_ok=True)
            if not picture.of_page:
                shutil.copyfile(source, picture.path)
            elif browser:
                photograph_journal(prefix, browser, source, picture)
            else:
                print(f"{picture.path.name} stays as it is: no Chromium (deploy/install-packages browser)",
                      file=sys.stderr)
                return
            made.append(f"{picture.path.name} {picture.path.stat().st_size // 1000} kB")

        with tempfile.TemporaryDirectory(prefix="treeroll-pictures-") as home:
            Reader(TUTORIALS / f"{name}.md", Path(home), prefix, own_network(92)).read(see)
        print(f"{name}: {', '.join(made) or 'no picture'}", flush=True)


if __name__ == "__main__":
    main()
