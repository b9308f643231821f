#!/usr/bin/env python3
"""Draws the sketches of the manual, brake.svg and trains.svg, beside this file: python3 docs/figures/sketches.py

The colours are of medium lightness and there is no background, so that the sketches are readable on white and on dark pages.
"""

import re
from pathlib import Path

INK, ROTOR, STATOR, FORCE = "#76808a", "#2f81d7", "#cf6a17", "#3f9142"
SANS = "font-family=\"'DejaVu Sans', Verdana, sans-serif\""
MONO = "font-family=\"'DejaVu Sans Mono', Menlo, Consolas, monospace\""


class Sketch:
    def __init__(self, name, width, height, title, description):
        self.name, self.parts = name, [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            'role="img" fill="none" stroke-width="1.8" stroke-linejoin="round" stroke-linecap="round">',
            f"<title>{title}</title>",
            f"<desc>{description}</desc>",
        ]

    def path(self, d, colour=INK, extra=""):
        self.parts.append(f'<path d="{d}" stroke="{colour}" {extra}/>')

    def body(self, x, y, width, height, colour):
        self.parts.append(
            f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="3" fill="{colour}" fill-opacity="0.22" stroke="{colour}"/>'
        )

    def text(self, x, y, text, colour=INK, size=14, anchor="middle", weight="normal"):
        """`x_y` is a subscript, *x* is italic, `key` is a key of a case file, in a fixed width."""
        out, keys = [], text.split("`")
        for index, piece in enumerate(keys):
            if index % 2:
                out.append(f'<tspan {MONO} font-size="{size - 1.5}">{piece}</tspan>')
                continue
            for k, part in enumerate(piece.split("*")):
                style = ' font-style="italic"' if k % 2 else ""
                names = re.split(r"_(\w+)", part) if k % 2 else [part]
                for n, name in enumerate(names):
                    if n % 2:
                        out.append(f'<tspan dy="4" font-size="{size - 4}">{name}</tspan><tspan dy="-4">&#8203;</tspan>')
                    elif name:
                        out.append(f"<tspan{style}>{name}</tspan>")
        self.parts.append(
            f'<text x="{x}" y="{y}" {SANS} font-size="{size}" font-weight="{weight}" text-anchor="{anchor}" fill="{colour}" '
            f'xml:space="preserve">{"".join(out)}</text>'
        )

    def arrow(self, x1, y1, x2, y2, colour=FORCE):
        length = ((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5
        ux, uy = (x2 - x1) / length, (y2 - y1) / length
        bx, by = x2 - 9 * ux, y2 - 9 * uy
        self.path(f"M{x1} {y1}L{bx} {by}", colour)
        self.parts.append(
            f'<path d="M{x2} {y2}L{bx - 4.5 * uy} {by + 4.5 * ux}L{bx + 4.5 * uy} {by - 4.5 * ux}Z" fill="{colour}"/>'
        )

    def spring(self, x1, x2, y, colour=INK):
        """A zigzag."""
        lead, teeth = 8, 6
        step = (x2 - x1 - 2 * lead) / (2 * teeth)
        points = [f"M{x1} {y}H{x1 + lead}"]
        for k in range(2 * teeth):
            points.append(f"L{x1 + lead + (k + 0.5) * step:.1f} {y + (8 if k % 2 else -8)}")
        points.append(f"L{x2 - lead} {y}H{x2}")
        self.path("".join(points), colour)

    def damper(self, x1, x2, y, colour=INK):
        """A dashpot."""
        mid = (x1 + x2) / 2
        self.path(f"M{x1} {y}H{mid - 4}M{mid - 4} {y - 6}V{y + 6}M{mid - 12} {y - 10}H{mid + 10}V{y + 10}H{mid - 12}M{mid + 10} {y}H{x2}", colour)

    def wall(self, x, y1, y2, colour=INK, side=1):
        """A wall that is fixed, hatched on the side `side`."""
        hatches = "".join(f"M{x} {y}l{8 * side} 8" for y in range(y1, y2 - 6, 11))
        self.path(f"M{x} {y1}V{y2}{hatches}", colour)

    def turn(self, x, y, colour):
        """An arrow around the horizontal axis through (x, y)."""
        self.path(f"M{x - 6} {y + 22}A 11 26 0 1 1 {x + 8} {y + 19}", colour)
        self.parts.append(f'<path d="M{x + 3} {y + 28}l1 -11l9 4Z" fill="{colour}"/>')

    def save(self):
        path = Path(__file__).with_name(self.name)
        path.write_text("\n".join([*self.parts, "</svg>", ""]), encoding="utf-8")


def brake():
    s = Sketch(
        "brake.svg", 900, 500, "The two-disk brake",
        "Rotor, torsion spring, rotor surface, contact, stator surface, torsion spring and stator along one axis; "
        "below, the axial motion of the mass under the actuation force",
    )
    y = 165
    s.text(12, 24, "Rotation, along the axis", anchor="start", weight="bold", size=15)
    s.path(f"M30 {y}H640", INK, 'stroke-dasharray="14 5 3 5" stroke-width="1"')
    # The rotor and its surface.
    s.body(120, 75, 46, 180, ROTOR)
    s.turn(82, y, ROTOR)
    s.text(70, 118, "*θ*, *ω_0*", ROTOR)
    s.spring(166, 340, y - 26)
    s.damper(166, 340, y + 26)
    s.body(340, 95, 20, 140, ROTOR)
    # The contact.
    s.path("M366 95V235", FORCE, 'stroke-dasharray="2 6" stroke-width="3"')
    s.body(372, 95, 20, 140, STATOR)
    s.spring(392, 566, y - 26)
    s.damper(392, 566, y + 26)
    s.wall(566, 85, 245, STATOR)
    # Names above, symbols and keys below.
    s.text(143, 62, "rotor", ROTOR, weight="bold")
    s.text(333, 62, "rotor surface", ROTOR, anchor="end", weight="bold")
    s.text(333, 80, "angle *φ_2*", ROTOR, anchor="end")
    s.text(400, 62, "stator surface", STATOR, anchor="start", weight="bold")
    s.text(400, 80, "angle *φ_1*", STATOR, anchor="start")
    s.text(588, 140, "stator", STATOR, anchor="start", weight="bold")
    s.text(588, 158, "does not turn", STATOR, anchor="start")
    s.text(143, 277, "*I*", ROTOR)
    s.text(143, 296, "`torsion.rotor_inertia`", ROTOR)
    s.text(253, 124, "*k_t*  `torsion.stiffness`", size=13)
    s.text(253, 219, "*c_t*  `torsion.damping`", size=13)
    s.text(479, 124, "*k_t*", size=13)
    s.text(479, 219, "*c_t*", size=13)
    s.text(366, 258, "*J*  each", INK)
    s.text(366, 277, "`torsion.surface_inertia`", INK)
    # What acts in the contact.
    s.text(700, 76, "the contact", FORCE, anchor="start", weight="bold")
    s.text(700, 97, "speed *ω_r* = *φ_2*′ − *φ_1*′", FORCE, anchor="start")
    s.text(700, 118, "*r*   `contact.radius`", FORCE, anchor="start")
    s.text(700, 139, "*μ_0*  `friction.breakaway`", FORCE, anchor="start")
    s.text(700, 160, "*μ_s*  `friction.low_speed`", FORCE, anchor="start")
    s.text(700, 181, "*μ_d*  `friction.high_speed`", FORCE, anchor="start")
    s.text(700, 202, "*α*   `friction.decay`", FORCE, anchor="start")
    s.text(12, 330, "*ω_0*  `initial.speed`: the speed of rotor and rotor surface at the start", ROTOR, anchor="start")
    # The axial motion.
    s.text(12, 376, "Along the axis: the contact force", anchor="start", weight="bold", size=15)
    y = 430
    s.arrow(70, y, 150, y)
    s.text(60, y - 18, "*F*(*t*)", FORCE, anchor="middle")
    s.body(150, 395, 70, 70, ROTOR)
    s.text(185, y + 5, "*m*", ROTOR, size=16)
    s.spring(220, 380, y - 18)
    s.damper(220, 380, y + 18)
    s.wall(380, 390, 470, STATOR)
    s.path(f"M185 {490 - 10}V488", ROTOR)
    s.arrow(185, 484, 145, 484, ROTOR)
    s.text(130, 488, "*z*", ROTOR, anchor="end")
    s.text(300, 393, "*k_e*", size=13)
    s.text(300, 476, "*c_a*", size=13)
    s.text(430, 396, "*F_0*, *t_0*  `actuation.force`, `.rise_time`: a ramp, then constant", FORCE, anchor="start")
    s.text(430, 419, "*m*  `axial.mass`", ROTOR, anchor="start")
    s.text(430, 442, "*k_e*, *c_a*  `axial.stiffness`, `axial.damping`", anchor="start")
    s.text(430, 465, "*F_n*  = −*k_e* *z* − *c_a* *z*′, the contact force", FORCE, anchor="start")
    s.save()


def trains():
    s = Sketch(
        "trains.svg", 900, 530, "Two trains and their contact",
        "Above, rotor and stator as chains of bodies and springs on both sides of the contact; below, a block on a belt: "
        "the belt is the rotor, the block with its spring the stator",
    )
    s.text(12, 24, "In general: two trains that touch", anchor="start", weight="bold", size=15)
    y, top, bottom = 160, 110, 210
    middle = 450
    for side, colour, name in ((-1, ROTOR, "rotor"), (1, STATOR, "stator")):
        def x(distance):
            return middle + side * distance

        def body(distance, width, low=top, high=bottom):
            s.body(min(x(distance), x(distance + width)), low, width, high - low, colour)

        def between(draw, one, other, dy):
            draw(min(x(one), x(other)), max(x(one), x(other)), y + dy)

        body(6, 30)
        between(s.spring, 36, 160, -20)
        between(s.damper, 36, 160, 20)
        body(160, 44)
        between(s.spring, 204, 328, -20)
        between(s.damper, 204, 328, 20)
        s.wall(x(328), 105, 215, colour, side)
        s.text(x(21), 100, "`inertia.0`", colour, anchor="end" if side < 0 else "start")
        s.text(x(182), 100, "`inertia.1`", colour)
        s.text(x(98), 126, "`stiffness.0`", size=13)
        s.text(x(98), 206, "`damping.0`", size=13)
        s.text(x(266), 126, "`stiffness.1`", size=13)
        s.text(x(266), 206, "`damping.1`", size=13)
        s.text(x(100), 56, f"`[{name}]`", colour, weight="bold", size=17)
        s.text(x(328), 72, "`end`: free,", colour, anchor="middle")
        s.text(x(328), 90, "fixed or driven", colour, anchor="middle")
        s.text(x(60), 76, "the surface", colour, anchor="end" if side < 0 else "start")
        # A damper to the ground below the outer body, and a torque on it.
        s.path(f"M{x(182)} {bottom}V234M{x(182) - 8} 234H{x(182) + 8}M{x(182) - 12} 228V244H{x(182) + 12}V228M{x(182)} 244V260M{x(182) - 16} 260H{x(182) + 16}")
        s.text(x(204), 250, "`viscous.1`", anchor="end" if side < 0 else "start", size=13)
    s.path(f"M{middle} {top}V{bottom}", FORCE, 'stroke-dasharray="2 6" stroke-width="3"')
    s.text(middle, 236, "`[contact]`, `[friction]`", FORCE)
    s.text(230, 290, "`speed` of a driven end, `torque` on a body", ROTOR)
    s.text(670, 290, "the same keys", STATOR)

    s.text(12, 345, "A block on a belt: the belt is the rotor, the block is the stator", anchor="start", weight="bold", size=15)
    # The belt.
    left, right, high, low = 290, 640, 450, 506
    radius = (low - high) / 2
    s.path(f"M{left} {high}H{right}A{radius} {radius} 0 0 1 {right} {low}H{left}A{radius} {radius} 0 0 1 {left} {high}Z", ROTOR, 'stroke-width="4"')
    for centre in (left, right):
        s.parts.append(f'<circle cx="{centre}" cy="{(high + low) / 2}" r="{radius - 7}" stroke="{ROTOR}"/>')
    s.arrow(520, high + 18, 600, high + 18, ROTOR)
    s.text(512, high + 24, "`rotor.speed`", ROTOR, anchor="end")
    # The block with its spring, and what presses it.
    s.body(380, 380, 130, 66, STATOR)
    s.text(445, 418, "`stator.inertia`", STATOR, size=13.5)
    s.spring(240, 380, 398)
    s.damper(240, 380, 428)
    s.wall(240, 375, 452, STATOR, -1)
    s.text(222, 402, "`stator.stiffness`", anchor="end", size=13)
    s.text(222, 432, "`stator.damping`", anchor="end", size=13)
    s.text(222, 452, "`stator.end = \"fixed\"`", STATOR, anchor="end", size=13)
    s.arrow(445, 352, 445, 380)
    s.text(456, 369, "`contact.normal_force`", FORCE, anchor="start")
    s.text(690, 418, "`motion = \"translation\"`:", anchor="start")
    s.text(690, 438, "kg, m, N instead of", anchor="start")
    s.text(690, 458, "kg m², rad, N m", anchor="start")
    s.text(690, 490, "`rotor.end = \"driven\"`,", ROTOR, anchor="start")
    s.text(690, 510, "no inertia of its own", ROTOR, anchor="start")
    s.save()


brake()
trains()
