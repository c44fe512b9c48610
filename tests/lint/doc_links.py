"""Every link, heading and picture that README.md and docs/ name is there; every page is reached from README.md; no picture
is left over or larger than 300 kB.  Run in the root of the tree."""
import os
import re
import subprocess
import sys

LARGEST = 300_000
LINK = re.compile(r'\]\(([^)\s]+)\)|(?:src|href)="([^"]+)"')

files = set(subprocess.check_output(["git", "ls-files"], text=True).split("\n"))
folders = {os.path.dirname(f) for f in files}
pages = [f for f in sorted(files) if f == "README.md" or (f.startswith("docs/") and f.endswith(".md"))]
bad = []


def prose(page):
    """The lines outside of code."""
    with open(page, encoding="utf-8") as text:
        fenced = False
        for line in text:
            fenced ^= line.startswith("```")
            if not fenced and not line.startswith("    "):
                yield re.sub(r"`[^`]*`", "", line) if not line.startswith("#") else line


def anchors(page):
    """As GitHub makes them of headings."""
    seen = {}
    for line in prose(page):
        if heading := re.match(r"#+ (.*)", line):
            words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading[1]).strip().lower()
            name = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
            seen[name] = seen.get(name, -1) + 1
            yield f"{name}-{seen[name]}" if seen[name] else name


links = {}
for page in pages:
    links[page] = set()
    for match in (m for line in prose(page) for m in LINK.finditer(line)):
        target = match[1] or match[2]
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = os.path.normpath(os.path.join(os.path.dirname(page), name)) if name else page
        links[page].add(file)
        if file not in files and file not in folders:
            bad.append(f"{page}: there is no {target}")
        elif anchor and file in pages and anchor not in anchors(file):
            bad.append(f"{page}: {file} has no heading for #{anchor}")

reached, ahead = set(), ["README.md"]
while ahead:
    page = ahead.pop()
    if page in links and page not in reached:
        reached.add(page)
        ahead += links[page]
bad += [f"{page}: no page leads here from README.md" for page in pages if page not in reached]

shown = set().union(*links.values())
for file in sorted(files):
    if file.startswith("docs/") and file.endswith((".png", ".svg", ".webp", ".jpg")):
        if file not in shown:
            bad.append(f"{file}: no page shows it")
        if os.path.getsize(file) > LARGEST:
            bad.append(f"{file}: {os.path.getsize(file)} bytes; {LARGEST} are allowed")

print("\n".join(bad))
sys.exit(bool(bad))
