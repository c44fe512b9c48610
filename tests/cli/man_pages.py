"""The manual pages that the build writes: one for every command, with everything that docs/cli.md says, without a word
from mandoc or man."""
import os
import re
import shutil
import subprocess
import sys
import tempfile

BUILD, BIN, SOURCE = (os.environ[f"WEFT_TEST_{name}"] for name in ("BUILD", "BIN", "SOURCE"))
MAN = f"{BUILD}/man"


def run(*words, **more):
    return subprocess.run(words, capture_output=True, text=True, check=True, **more).stdout


def words(text):
    return " ".join(re.sub(r"[\u2010-\u2015\u2212]", "-", text.replace("\u2019", "'")).split())


def rendered(page):
    return words(run("mandoc", "-T", "utf8", "-O", "width=900", page).replace("\b", "\0").replace("_\0", ""))


def commands():
    """Name, details and rows of every command, from the other document that is written from the tables."""
    with open(f"{SOURCE}/docs/cli.md", encoding="utf-8") as page:
        parts = re.split(r"^## weft (.*)$", page.read(), flags=re.M)
    for name, text in zip(parts[1::2], parts[2::2]):
        rows = re.findall(r"^\| `--([a-z-]+)`(?: `-(.)`)? \| (.*?) \| (.*?) \| (.*?) \|$", text, re.M)
        yield name, text.split("\nExample:\n\n    ")[1].strip(), rows


def plain(text):
    """As letters on the screen: mandoc overstrikes bold ones."""
    return re.sub(r"(.)\0\1", r"\1", text)


def main():
    if not shutil.which("mandoc"):
        print("skipped: no mandoc")
        sys.exit(77)
    pages = sorted(f"{MAN}/{folder}/{name}" for folder in ("man1", "man8") for name in os.listdir(f"{MAN}/{folder}"))
    found = {os.path.basename(page) for page in pages}
    wanted = {"weft.1", "weftd.8"} | {f"weft-{name.replace(' ', '-')}.1" for name, *_ in commands()}
    assert found == wanted and len(wanted) > 30, found ^ wanted
    for page in pages:
        lint = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", page], capture_output=True, text=True, check=False)
        assert not lint.stdout + lint.stderr, lint.stdout + lint.stderr
    n_rows = 0
    for name, example, rows in commands():
        text = plain(rendered(f"{MAN}/man1/weft-{name.replace(' ', '-')}.1"))
        assert words(example) in text, (name, example)
        for key, letter, _, default, told in rows:
            option = f"--{key}, -{letter}" if letter else f"--{key}"
            assert option in text and words(told.removesuffix(" (needed)")) in text, (name, option, told)
            assert not default or f"default: {words(default)}" in text, (name, option, default)
            n_rows += 1
    daemon = plain(rendered(f"{MAN}/man8/weftd.8"))
    for option in re.findall(r"--[a-z-]+", run(f"{BIN}/weftd", "--help").split("options:")[1].split("example:")[0]):
        assert option in daemon, option
    assert "weftd.service" in daemon and "weftd.socket" in daemon
    with tempfile.TemporaryDirectory() as folder:
        run("cmake", "--install", BUILD, "--prefix", folder)
        installed = {name for part in ("man1", "man8") for name in os.listdir(f"{folder}/share/man/{part}")}
        assert installed == wanted, installed ^ wanted
        if shutil.which("man"):
            for page in ("weft", "weftd", "weft-light-set", "weft-calibrate-colour"):
                shown = subprocess.run(["man", "--warnings", "-M", f"{folder}/share/man", page], capture_output=True,
                                       text=True, check=True, env=dict(os.environ, LC_ALL="C.UTF-8", MANPAGER="cat"))
                assert not shown.stderr and page.upper() in shown.stdout, (page, shown.stderr)
    print(f"{len(pages)} pages, {n_rows} options")


main()
