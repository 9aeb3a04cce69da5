"""What is used of equinox beyond its documented interface: a version that moves it is met here alone.

- `while_loop`: a loop of bounded length that can be differentiated in reverse mode, at any depth of nesting.
- `unvmap_any`: whether anything holds in any member of a batch, so that a branch no member takes is not computed.

Of diffrax, only `DirectAdjoint._loop` is private: `_integrate/adjoint.py` derives from it.
"""

from equinox.internal import unvmap_any as unvmap_any
from equinox.internal import while_loop as while_loop
