#!/usr/bin/env python3
"""The deepest stack that a program for the ATmega328P can have, from its machine code.

Every instruction that can be reached from the reset vector and the interrupt vectors is walked with the depth of
the stack at it: pushes, calls, and frames that are taken by moving the stack pointer.  The bound is

    main and all it calls + the deepest interrupt that lets others in + the deepest one that does not.

It is refused, with the place, where that would not be a bound: recursion, an indirect call that is not through the
table named by --table, a stack pointer moved by what is not a constant, paths that meet at different depths, an
interrupt that lets others in before it has switched off those that do so (--quiet names the registers that it must
clear).
"""
import argparse
import re
import subprocess
import sys

RAM_END, RETURN_BYTES = 0x8FF, 2  # of the ATmega328P
BRANCH = re.compile(r"br(eq|ne|cs|cc|sh|lo|mi|pl|ge|lt|hs|hc|ts|tc|vs|vc|ie|id)$")
SKIP = {"cpse", "sbrc", "sbrs", "sbic", "sbis"}
FAR = {"ijmp", "eijmp", "eicall", "jmp*", "spm", "break"}


class Refused(Exception):
    pass


class Program:
    def __init__(self, elf, table):
        self.code, self.label, self.order = {}, {}, []
        for line in run("avr-objdump", "-d", elf).splitlines():
            if m := re.match(r"([0-9a-f]+) <(.+)>:$", line):
                self.label[int(m[1], 16)] = m[2]
            elif m := re.match(r" +([0-9a-f]+):\t(?:[0-9a-f]{2} )+ *\t(\S+)\t?([^;]*)(?:; 0x([0-9a-f]+))?", line):
                self.code[int(m[1], 16)] = (m[2], [a.strip() for a in m[3].split(",")], m[4] and int(m[4], 16))
                self.order.append(int(m[1], 16))
        self.after = dict(zip(self.order, self.order[1:]))
        self.indirect = self.read_table(elf, table) if table else []
        self.frames, self.open = {}, []

    def read_table(self, elf, table):
        """The functions in an array of structs: NAME:BYTES:OFFSET, bytes of an entry and where its pointer is."""
        name, size, offset = table.split(":")
        for line in run("avr-nm", "-S", elf).splitlines():
            if line.endswith(" " + name):
                start, n = (int(x, 16) for x in line.split()[:2])
                break
        else:
            raise Refused(f"there is no table {name}")
        data_begin = next(int(l.split()[0], 16) for l in run("avr-nm", elf).splitlines() if l.endswith(" __data_start"))
        image = subprocess.run(["avr-objcopy", "-O", "binary", "-j", ".data", elf, "/dev/stdout"], check=True,
                               capture_output=True).stdout
        data = image[start - data_begin:start - data_begin + n]
        if len(data) < n or n % int(size):
            raise Refused(f"the table {name} cannot be read")
        places = range(int(offset), n, int(size))
        entries = [2 * int.from_bytes(data[i:i + 2], "little") for i in places]  # words to bytes
        for entry in entries:
            if entry not in self.label:
                raise Refused(f"the table {name} holds 0x{entry:x}, where no function begins")
        return entries

    def place(self, at):
        begin = max(a for a in self.label if a <= at)
        return f"{self.label[begin]}+0x{at - begin:x}"

    def next(self, at):
        """Instructions that may follow this one, without those of what it calls."""
        name, _, target = self.code[at]
        behind = self.after.get(at)
        if name in ("ret", "reti"):
            return []
        if name in ("jmp", "rjmp"):
            return [target]
        if name in FAR:
            raise Refused(f"{self.place(at)}: {name}")
        if BRANCH.match(name):
            return [behind, target]
        return [behind, self.after.get(behind)] if name in SKIP else [behind]

    def calls(self, at):
        name, _, target = self.code[at]
        if name == "icall":
            if not self.indirect:
                raise Refused(f"{self.place(at)}: a call of what only the running program knows")
            return self.indirect
        return [target] if name in ("call", "rcall") and target != self.after[at] else []

    def depth_of(self, entry):
        """Bytes below the return address of a function at its deepest, with all that it calls."""
        if entry in self.open:
            raise Refused(f"{self.place(entry)} calls itself")
        if entry not in self.frames:
            self.open.append(entry)
            self.frames[entry] = self.walk(entry)
            self.open.pop()
        return self.frames[entry]

    def walk(self, entry):
        seen, todo, deepest = {}, [(entry, 0, None)], 0
        while todo:
            at, depth, y = todo.pop()
            if at not in self.code:
                raise Refused(f"{self.place(entry)} runs on to 0x{at or 0:x}, where no code is")
            if at in seen:
                if seen[at][0] != depth:
                    raise Refused(f"{self.place(at)}: {seen[at][0]} or {depth} bytes deep")
                if seen[at][1] in (y, None):
                    continue
                y = None
            seen[at] = (depth, y)
            for callee in self.calls(at):
                deepest = max(deepest, depth + RETURN_BYTES + self.depth_of(callee))
            depth, y = self.step(at, depth, y)
            deepest = max(deepest, depth)
            if self.code[at][0] in ("ret", "reti") and depth != 0:
                raise Refused(f"{self.place(at)}: returns {depth} bytes deep")
            todo += [(to, depth, y) for to in self.next(at)]
        return deepest

    def step(self, at, depth, y):
        """Depth behind an instruction, and that of the place where r29:r28 points (None: elsewhere)."""
        name, args, target = self.code[at]
        first = args[0] if args else ""
        if "Y+" in args or "-Y" in args:
            return depth, None
        if name == "push":
            return depth + 1, y
        if name == "pop":
            return depth - 1, None if first in ("r28", "r29") else y
        if name == "rcall" and target == self.after[at]:  # room for two bytes
            return depth + 2, y
        if name == "out" and first in ("0x3d", "0x3e"):
            if args[1] != {"0x3d": "r28", "0x3e": "r29"}[first] or y is None:
                raise Refused(f"{self.place(at)}: moves the stack pointer by what is no constant")
            return (y if first == "0x3d" else depth), y  # the halves come together, interrupts off
        if first not in ("r28", "r29"):
            return depth, None if name == "movw" and first == "r28" else y
        if name == "in" and args[1] in ("0x3d", "0x3e"):
            return depth, depth
        if name == "ldi":  # start-up: the end of the RAM, low byte first
            return depth, 0 if int(args[1], 16) == (RAM_END & 255 if first == "r28" else RAM_END >> 8) else None
        if name in ("sbiw", "adiw") and y is not None:
            return depth, y + int(args[1], 16) * (1 if name == "sbiw" else -1)
        if name == "subi" and first == "r28" and y is not None:  # and sbci, sbc of r29 behind it
            return depth, y + self.whole_constant(at)
        if name in ("sbci", "sbc") and self.code[self.before(at)][0] == "subi":
            return depth, y
        reads_only = name in ("out", "st", "std", "sts", "cp", "cpc", "cpi", "cpse", "sbrc", "sbrs", "tst")
        return depth, y if reads_only else None

    def before(self, at):
        return self.order[self.order.index(at) - 1]

    def whole_constant(self, at):
        name, args, _ = self.code[self.after[at]]
        low = int(self.code[at][1][1], 16)
        if name == "sbci" and args[0] == "r29":
            value = low + 256 * int(args[1], 16)
        elif name == "sbc" and args == ["r29", "r1"]:  # r1 is 0
            value = low
        else:
            raise Refused(f"{self.place(at)}: half a stack pointer")
        return value - 65536 if value >= 32768 else value

    def reached(self, entry):
        """All instructions of a function and of what it calls, in the order of a walk."""
        seen, todo = [], [entry]
        known = set()
        while todo:
            at = todo.pop()
            if at in known:
                continue
            known.add(at)
            seen.append(at)
            todo += list(self.calls(at)) + self.next(at)[::-1]
        return seen

    def lets_others_in(self, vector, quiet):
        """Whether an interrupt says sei; and that each time it has cleared the `quiet` registers just before."""
        reached = self.reached(vector)
        targets = {to for name, _, to in self.code.values() if name in ("jmp", "rjmp") or BRANCH.match(name)}
        opened = [at for at in reached if self.code[at][0] == "sei"]
        for sei in opened:
            at, missing = sei, set(quiet)
            while missing and at not in targets:  # back through instructions that follow each other
                at = self.before(at)
                name, args, _ = self.code[at]
                if len(self.next(at)) != 1 or self.calls(at) or name in ("jmp", "rjmp"):
                    break
                if name == "sts" and args[1] == "r1":
                    missing.discard(int(args[0], 16))
            if missing:
                left = ", ".join(f"0x{m:x}" for m in sorted(missing))
                raise Refused(f"{self.place(sei)}: lets in others like it: {left}")
        return bool(opened)

    def vectors(self):
        """What the interrupts begin with, the reset first; those that nobody serves left out."""
        begins = [self.code[at][2] for at in range(0, 26 * 4, 4)]
        return begins[:1] + [b for b in begins[1:] if self.label.get(b) != "__bad_interrupt"]


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def bound(elf, table, quiet):
    p = Program(elf, table)
    begin, *vectors = p.vectors()
    main = p.depth_of(begin)
    inside = {v: RETURN_BYTES + p.depth_of(v) for v in vectors}
    outer = [v for v in vectors if p.lets_others_in(v, quiet)]
    most = lambda of: max((inside[v] for v in of), default=0)
    return main, most(outer), most(v for v in vectors if v not in outer)


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("elf")
    a.add_argument("--table", metavar="NAME:BYTES:OFFSET", help="the array of structs whose pointers icall calls")
    a.add_argument("--quiet", type=lambda t: [int(x, 16) for x in t.split(",")], default=[], metavar="0x6f,...")
    a.add_argument("--most", type=int, help="bytes; fails when the bound is above")
    a = a.parse_args()
    try:
        parts = bound(a.elf, a.table, a.quiet)
    except Refused as why:
        sys.exit(f"no bound: {why}")
    print("stack: %d bytes at most: %d of the program, %d and %d of interrupts" % (sum(parts), *parts))
    if a.most is not None and sum(parts) > a.most:
        sys.exit(f"more than {a.most} bytes")


if __name__ == "__main__":
    main()
