"""Functions that compiled code calls by number, so that it is compiled once for whatever they are.

numba's own first-class functions would do, but for a typed list of them, which takes seconds to
compile and counts its holders at each step.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.extending import intrinsic
from numba.core.types.containers import Tuple
from numba.np.arrayobj import make_array

from tieline import kernels
from tieline.compiled import IS_ON
from tieline.whole_program import Callback


def first_class(functions: Sequence[Callable[..., None]], signature: Any) -> Any:
    """Return functions of one signature as what `caller` takes: their addresses, (functions,).

    With the compiler off they stay as they are.
    """
    if not IS_ON:
        return tuple(functions)
    return np.array([_callback(function, signature).address for function in functions], np.intp)


@cache
def caller(signature: Any) -> Any:
    """Return what calls one of some functions: (functions, number, arguments), for compiled code.

    The functions are those of `first_class` with the same signature, which returns nothing; the
    arguments are a tuple, of just its types.
    """
    return _compiled_caller(signature) if IS_ON else _call


def _call(functions: Any, number: int, arguments: tuple[Any, ...]) -> None:
    functions[number](*arguments)


def _compiled_caller(signature: Any) -> Any:
    taken = Tuple(signature.args)

    def emit(context: Any, builder: Any, typed: Any, values: Any) -> Any:
        addresses = make_array(typed.args[0])(context, builder, values[0])
        address = builder.load(builder.gep(addresses.data, [values[1]]))
        passed = [context.get_value_type(argument) for argument in signature.args]
        function = ir.FunctionType(context.get_value_type(signature.return_type), passed)
        arguments = cgutils.unpack_tuple(builder, values[2])
        builder.call(builder.inttoptr(address, function.as_pointer()), arguments)
        return context.get_dummy_value()

    def call(typing_context: Any, functions: Any, number: Any, arguments: Any) -> Any:
        if arguments != taken:
            raise TypingError(f"a function that takes {taken} is called with {arguments}")
        return types.void(functions, types.intp, taken), emit

    # By its name it is told apart where compiled code is kept.
    call.__name__ = f"call of {signature}"
    return intrinsic(call)


@cache
def _callback(function: Callable[..., None], signature: Any) -> Any:
    options = {"error_model": "numpy"}
    result: Any = Callback(function, signature, options)
    result._cache = kernels.Kernels(function, f"callback {options}")
    result.compile()
    return result
