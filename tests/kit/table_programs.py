"""Table programs in the dialect of the thesis appendix."""

APPENDIX = """\
%Demo Macro

:mode:position all

% otsro4ka
:demand:position 1,0; p 2,0; p 3,0
delay 10
%1 rt
:demand:position 1,135; p 2,90; p 3,-9
delay 102
%2 rt
:demand:position 1,135; p 2,90; p 3,-189
delay 60
%3 rt
:demand:position 1,-45; p 2,90; p 3,-189
delay 60
:demand:position 1,-45; p 2,-90; p 3,-189
delay 60
% 90 grad
%4 rt
:demand:position 1,-135; p 2,-90; p 3,-189
delay 60
%5 rt
:demand:position 1, -135; p 2,-90; p 3,-9
delay 60
%razvorot 180
%6 rt
:demand:position 1,45; p 2,-90; p 3,-9
delay 60
%razvorot na 180
:demand:position 1,45; p 2,90; p 3,-9
delay 60
% 90 g
%7 rt
:demand:position 1,45; p 2,0; p 3,-9
delay 60
%razvorot na 180
%8 rt
:demand:position 1,45; p 2,0; p 3,-189
delay 60
%razvorot na 180
:demand:position 1,45; p 2,180; p 3,-189
delay 60

% 90 g
%9 rt
:demand:position 1,-45; p 2,180; p 3,-189
delay 60
%razvorot na 180
:demand:position 1,-45; p 2,0; p 3,-189
delay 60

% end
%10 (1) rt
:demand:position 1,-45; p 2,-90; p 3,-189
delay 60

:demand:position 1,0; p 2,0; p 3,0
delay 100
"""
"""The macro of the thesis's appendix Д, as printed."""


HOME = ":demand:position 1,0; p 2,0; p 3,0\ndelay 10\n"
