#!/usr/bin/env python3
"""Make glyphs.inc anew: outlines of the characters that pictures need, from a TrueType font.

    outlines.py DejaVuSans.ttf > ../glyphs.inc      (Debian: python3-fonttools, fonts-dejavu-core)

Only for who adds a character: the build takes it as it is in the repository.
"""
import sys

from fontTools.pens.svgPathPen import SVGPathPen
from fontTools.ttLib import TTFont

CHARACTERS = [chr(c) for c in range(32, 127)] + list("°±²³µ·×Ωαβγδεθλμνρστφω−–—→∞≤≥σÄÖÜßäöüàâçèéêëîïôùûáíóúñÅåØøÆæ")

font = TTFont(sys.argv[1])
names, glyphs = font.getBestCmap(), font.getGlyphSet()
print("// Made by font/outlines.py from DejaVu Sans (font/LICENSE): code point, advance, outline.")
for code in sorted({ord(c) for c in CHARACTERS}):
    glyph = glyphs[names[code]]
    pen = SVGPathPen(glyphs)
    glyph.draw(pen)
    print(f'{{0x{code:04x}, {glyph.width}, "{pen.getCommands()}"}},')
