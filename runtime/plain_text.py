"""Text as it may be shown: without control characters, escapes and marks that turn the direction of writing."""

from __future__ import annotations

import re

# C0 and C1 controls but for tab and line feed, soft hyphens, zero-width characters, marks of direction (Trojan Source),
# line separators, language tags, and halves of surrogate pairs.
_HIDDEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u00ad\u061c\u115f\u1160\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff"
    "\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)
_LONGEST_WORD = 400


def plain(text: str) -> str:
    """Return `text` with what does not show, or changes how the rest shows, written out as Python does (`\\x1b`)."""
    return _HIDDEN.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def shortened(text: str, longest: int = _LONGEST_WORD) -> str:
    """Return `text` with the middle of its overlong words left out."""
    return re.sub(
        rf"\S{{{longest + 1},}}", lambda word: f"{word[0][: longest // 2]} … {word[0][-longest // 8 :]}", text
    )
