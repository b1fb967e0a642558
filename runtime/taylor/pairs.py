"""Sums of products for two orders at once, for members of an ensemble side by side.

What a sum costs there is loading its factors: a coefficient that is loaded serves order n and order n + 1, and all
products of a group that have it. Order n + 1 then lacks the terms with coefficients that order n was needed for.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from symgen.runtime.taylor.code import Code, fused, load_row


@dataclass(frozen=True)
class Lanes:
    """Products of series computed side by side: `xs` times `ys`; `x`, `y`, `total` are places in the scratch array.

    `kind` is "product" (sum of x_j y_{n-j}), "square" (x and y are one) or "power" (terms times j (e + 1) - n).
    """

    kind: str
    width: int
    lead: int
    nodes: tuple[int, ...]
    xs: tuple[int, ...]
    ys: tuple[int, ...]
    x: int
    y: int
    total: int
    exponents: tuple[float, ...] = ()


class PairedSums:
    """The sums of some products.

    Parameters
    ----------
    code : Code
    products : list of Lanes
        Of width 1.
    ends : int
        As in `loops.sum_function`.
    """

    def __init__(self, code: Code, products: list[Lanes], ends: int) -> None:
        self.code, self.ends = code, ends
        uses = Counter(factor for item in products for factor in (item.xs[0], item.ys[0]))
        # Places of the factor that more products have, of the other one, of the sum and of that of the next order.
        self._products = sorted(
            (*_by_use(item, uses), item.total, code.reserve(1), item.lead) for item in products
        )

    def first(self) -> list[str]:
        """The sums of an order, and as far as they are known those of the next one."""
        groups: list[list] = []
        for lead in sorted({product[4] for product in self._products}):
            own = [product for product in self._products if product[4] == lead]
            size = self.code.registers // 4  # the sums of both orders are half the registers
            groups += [own[k : k + size] for k in range(0, len(own), size)]
        lines: list[str] = []
        for number, group in enumerate(groups):
            lines += self._loop(group, f"pair{number}", f"paired{number - 1}" if number else "")
        return lines

    def _loop(self, group: list, tag: str, before: str) -> list[str]:
        kind, after = self.code.number, tag.replace("pair", "paired")
        starts = list(dict.fromkeys(y for _, y, *_ in group))
        lines = [
            f"br label %{tag}", f"{tag}:",
            f"%n.{tag} = add i64 %k, {group[0][4]}", f"%top.{tag} = sub i64 %n.{tag}, {self.ends}",
            f"br label %head.{tag}", f"head.{tag}:",
            f"%j.{tag} = phi i64 [{self.ends}, %{tag}], [%next.{tag}, %body.{tag}]",
        ]  # fmt: skip
        # The term that order n + 1 does not know yet meets a zero.
        carried = [(f"%before.{tag}.{y}", f"%y.{tag}.{y}") for y in starts]
        sums = [(f"%{word}.{tag}.{i}", f"%{word}.more.{tag}.{i}") for i in range(len(group)) for word in "ab"]
        lines += [
            f"{held} = phi {kind} [zeroinitializer, %{tag}], [{new}, %body.{tag}]"
            for held, new in (*carried, *sums)
        ]
        lines += [
            f"%more.{tag} = icmp sle i64 %j.{tag}, %top.{tag}",
            f"br i1 %more.{tag}, label %body.{tag}, label %{after}",
            f"body.{tag}:",
            f"%m.{tag} = sub i64 %n.{tag}, %j.{tag}",
        ]
        for x in dict.fromkeys(x for x, *_ in group):
            lines += self._load(x, f"%j.{tag}", f"%x.{tag}.{x}")
        for y in starts:
            lines += self._load(y, f"%m.{tag}", f"%y.{tag}.{y}")
        for i, (x, y, *_) in enumerate(group):
            for word, factor in (("a", f"%y.{tag}.{y}"), ("b", f"%before.{tag}.{y}")):
                total = self._fused(f"%x.{tag}.{x}", factor, f"%{word}.{tag}.{i}")
                lines.append(f"%{word}.more.{tag}.{i} = {total}")
        lines += [f"%next.{tag} = add i64 %j.{tag}, 1", f"br label %head.{tag}", f"{after}:"]
        for i, (_, _, total, following, _) in enumerate(group):
            lines += self._store(f"%a.{tag}.{i}", total) + self._store(f"%b.{tag}.{i}", following)
        return lines

    def second(self) -> list[str]:
        """The sums of the next order, from what is known of them."""
        lines: list[str] = []
        loaded: set[str] = set()

        def load(start: int, index: str, text: str) -> str:
            name = f"%{index.strip('%')}.at{start}"
            if name not in loaded:
                loaded.add(name)
                lines.extend(self._load(start, text, name))
            return name

        for lead in sorted({product[4] for product in self._products}):
            lines += [f"%n{lead} = add i64 %k, {lead}", f"%late{lead} = sub i64 %n{lead}, {self.ends}"]
        for i, (x, y, total, following, lead) in enumerate(self._products):
            known = load(following, "known", "0")
            for step, (a, b) in enumerate((("early", f"late{lead}"), (f"late{lead}", "early"))):
                first, second = (
                    load(start, word, str(self.ends) if word == "early" else f"%{word}")
                    for start, word in ((x, a), (y, b))
                )
                lines.append(f"%sum{i}.{step} = {self._fused(first, second, known)}")
                known = f"%sum{i}.{step}"
            lines += self._store(known, total)
        return lines

    def _fused(self, a: str, b: str, c: str) -> str:
        return fused(self.code, 1, a, b, c)

    def _load(self, start: int, index: str, to: str) -> list[str]:
        return load_row(self.code, 1, start, index, to)

    def _store(self, value: str, place: int) -> list[str]:
        return [
            f"{value}.to = getelementptr inbounds {self.code.number}, ptr %scratch, i64 {place}",
            f"store {self.code.number} {value}, ptr {value}.to, align {self.code.align}",
        ]


def _by_use(item: Lanes, uses: Counter) -> tuple[int, int]:
    """Places of the factors of a product, first of the one that more products have."""
    pairs = ((item.xs[0], item.x), (item.ys[0], item.y))
    return tuple(place for _, place in sorted(pairs, key=lambda pair: (-uses[pair[0]], pair[0])))
