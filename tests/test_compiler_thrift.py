"""What numba is spared leaves its answers as they are."""

import gc
import operator

import pytest
from numba.core import types
from numba.core.compiler import Flags
from numba.core.registry import cpu_target

from tieline.compiled import IS_ON
from tieline.compiler_thrift import be_thrifty, seldom_collecting

pytestmark = pytest.mark.skipif(not IS_ON, reason="nothing is compiled")

OPERATORS = (operator.add, operator.truediv, operator.lt, operator.and_)
PAIRS = (
    (types.int64, types.int64),
    (types.int64, types.uint64),
    (types.float64, types.int64),
    (types.boolean, types.boolean),
    (types.IntegerLiteral(3), types.int64),
)


def test_an_answer_that_is_remembered_is_numbas_own():
    """Otherwise a sum of whole numbers could be taken for one of fractions, or the reverse."""
    be_thrifty()
    context = cpu_target.typing_context
    context.refresh()
    for function in map(context.resolve_value_type, OPERATORS):
        for pair in PAIRS:
            if function.typing_key is operator.and_ and types.float64 in pair:
                continue
            answers = [context.resolve_function_type(function, pair, {}) for _ in range(2)]
            assert answers[0] is answers[1]
            assert answers[0] == type(context).resolve_function_type(context, function, pair, {})


def test_options_of_a_compilation_differ_where_numba_lets_them_differ():
    """Otherwise a function would be taken that counts references where none are counted."""
    be_thrifty()
    usual, told, other = Flags(), Flags(), Flags()
    told.nrt, other.nrt = False, True
    assert usual == told
    assert hash(usual) == hash(told)
    assert usual != other
    assert usual != "nrt"


def test_garbage_is_collected_as_before_once_a_function_is_compiled():
    """Otherwise whatever comes after the first compilation would take up more and more memory."""
    before = gc.get_threshold()
    with pytest.raises(KeyError), seldom_collecting():
        raise KeyError(gc.get_threshold() > before)
    assert gc.get_threshold() == before
