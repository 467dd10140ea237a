"""Asks the processor for a line of memory before it is needed, from compiled code.

Code that goes from table to table by numbers that it has just read waits for each of them where the
tables exceed the nearer caches. A line that is asked for comes while the code does other things.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from tieline.compiled import IS_ON

Cells = NDArray[np.int64]


def _prefetch(cells: Cells, place: int) -> None:
    """Ask for the line that holds a place of an array of whole numbers; nothing else is changed.

    The place need not exist.
    """


def _generated(typing_context: Any, cells: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        line = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(8).as_pointer())
        word = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [line.type, word, word, word])
        function = builder.module.declare_intrinsic("llvm.prefetch", [line.type], kind)
        # To read, to be kept in every cache, data.
        builder.call(function, [line, word(0), word(3), word(1)])
        return context.get_dummy_value()

    return types.void(cells, place), generate


prefetch = intrinsic(_generated) if IS_ON else _prefetch
