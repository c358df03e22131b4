; a laser cutter, GRBL, absolute and incremental
; user origin
; Bounds: X0 Y0 to X60 Y40
G00 G17 G40 G21 G54
G90
M4
; Cut @ 1800 mm/min, 60% power
M8
G0 X0 Y0 Z2
G91
G0X10Y8
; Layer C00
G1X20S600F1800
X5.5Y3.25
y4.5
G3 X-5 Y5 I-5
G1X-15.5
G2X0Y-10I0J-5
g1 X-5Y-2.75 s0
M9
G0X12.5Y21
M8
G1 X30S600
G3X0Y0I-4J0
G1Y-8.125
M9
G1 S0
M5
G90
; return to user-defined finish pos
G0 X0 Y0
M2
