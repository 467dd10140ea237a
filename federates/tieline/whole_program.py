"""Compiles a function together with all that it calls, so that each is optimised once.

numba makes machine code of every function for itself and gives it two wrappers, one for Python and
one for C; whoever calls it then takes it in, with all that it calls, to optimise it again. What
lies ten calls deep is optimised ten times. Here a function that compiled code calls is only
translated; what Python calls, or C, is linked with all the translations that it needs, optimised
and made machine code of. What is computed stays the same to the last bit.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from typing import Any

from llvmlite.binding import Linkage
from numba.core import dispatcher, types
from numba.core.ccallback import CFunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompilerBase, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.environment import Environment
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.types.misc import unliteral

from tieline.compiler_thrift import be_thrifty, seldom_collecting

# numba has no type hints for these two.
FunctionCompiler: Any = dispatcher._FunctionCompiler  # type: ignore[attr-defined]
NumbaCallback: Any = CFunc

WITHOUT_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class Translation(JITCodeLibrary):
    """A function's code as numba translates it, which becomes machine code when that is asked for.

    A translation that uses others does not take them in before.
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._names: set[str] = set()
        self._shareable: Any = None

    @property
    def codegen(self) -> Any:
        """Return who makes machine code; without code there is no place for an environment."""
        return self._codegen if self._finalized else _Nowhere()

    def add_linking_library(self, library: Any) -> None:
        """Remember what this one uses."""
        if not isinstance(library, Translation):
            library._ensure_finalized()
        self._linking_libraries.append(library)

    def add_llvm_module(self, ll_module: Any) -> None:
        """Add functions, each simplified by itself: it is then shorter wherever it is taken in."""
        self._raise_if_finalized()
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = self._codegen._function_pass_manager()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)
                self._names.add(function.name)
        self._final_module.link_in(ll_module)

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function's machine code; 0 if it is not one of these."""
        if not self._finalized and name not in self._names:
            return 0
        address: int = super().get_pointer_to_function(name)
        return address

    def _get_module_for_linking(self) -> Any:
        """Return the functions as they are, for one of them to stay where many users bring them."""
        if self._finalized:
            return super()._get_module_for_linking()
        if self._shareable is None:
            self._shareable = self._final_module.clone()
            for name in self._names:
                function = self._shareable.get_function(name)
                if function.linkage == Linkage.external:
                    function.linkage = Linkage.linkonce_odr
        return self._shareable

    def finalize(self) -> None:
        """Take in all that is used, directly or not, and make machine code of it."""
        used = _callers_first(self)
        assert used[0] is self
        self._linking_libraries = used[1:]
        super().finalize()
        self._shareable = None


class _Nowhere:
    """Takes an environment for code that is not there."""

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


def _callers_first(library: Any) -> list[Any]:
    """Return a library and all that it uses, each behind all that use it.

    LLVM drops a function that nobody has asked for by the time that its module is linked.
    """
    found: list[Any] = []
    seen: set[Any] = set()

    def visit(one: Any) -> None:
        seen.add(one)
        if isinstance(one, Translation) and not one._finalized:
            for other in one._linking_libraries:
                if other not in seen:
                    visit(other)
        found.append(one)

    visit(library)
    return found[::-1]


@contextmanager
def _translating() -> Iterator[Any]:
    """Have whatever numba compiles meanwhile only translated; yields who makes machine code."""
    codegen = cpu_target.target_context.codegen()
    with global_compiler_lock, seldom_collecting():
        be_thrifty()
        before = codegen._library_class
        codegen._library_class = Translation
        try:
            yield codegen
        finally:
            codegen._library_class = before


class Kernel(CPUDispatcher):
    """A compiled function: machine code where Python calls it, a translation for compiled code.

    Args:
        py_func, locals, targetoptions, pipeline_class: as numba gives them.
    """

    def __init__(
        self,
        py_func: Callable[..., Any],
        locals: dict[str, Any] | None = None,
        targetoptions: dict[str, Any] | None = None,
        pipeline_class: type[CompilerBase] = Compiler,
    ) -> None:
        options = targetoptions or {}
        super().__init__(py_func, locals or {}, options, pipeline_class)
        inner = {**options, **WITHOUT_WRAPPERS}
        self._inner = CPUDispatcher(py_func, locals or {}, inner, pipeline_class)
        self._compiler: Any = _Whole(self._inner, self._compiler)

    @property
    def is_compiling(self) -> Any:
        """Return whether the function is being translated, as it asks when it calls itself."""
        return self._inner.is_compiling

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what a compiled caller needs to know of the types, and translate the function.

        A constant is passed as a number: numba would translate the function anew for each.
        """
        with _translating():
            return self._inner.get_call_template(*_without_constants(args, kws))

    def get_overload(self, sig: Any) -> Any:
        """Return what stands for the translation in compiled callers."""
        return self._inner.get_overload(sig)


def _without_constants(args: Any, kws: Any) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return types of arguments with those of whole numbers in place of constants'."""
    return (
        tuple(unliteral(arg) if isinstance(arg, types.Integer) else arg for arg in args),
        {
            name: unliteral(arg) if isinstance(arg, types.Integer) else arg
            for name, arg in kws.items()
        },
    )


class _Whole(FunctionCompiler):
    """Makes machine code of a translation, to be called from Python."""

    def __init__(self, inner: CPUDispatcher, numbas: Any) -> None:
        self.__dict__.update(numbas.__dict__)
        self._inner = inner

    def _compile_core(self, args: Any, return_type: Any) -> CompileResult:
        with _translating() as codegen:
            self._inner.compile((args, return_type) if return_type else args)
            result = self._inner.overloads[tuple(args)]
            library = Translation(codegen, self.py_func.__qualname__)
            library.enable_object_caching()
            library.add_linking_library(result.library)
            context, description = result.target_context, copy(result.fndesc)
            # The wrapper's constants have a place of their own: numba takes whatever environment
            # of a name it meets first for it, and a translation's is without them.
            description.env_name += "_of_wrapper"
            environment = Environment.from_fndesc(description)
            with context.push_code_library(library):
                context.create_cpython_wrapper(
                    library,
                    description,
                    environment,
                    result.call_helper,
                    release_gil=self.targetoptions.get("nogil", False),
                )
            entry = context.get_executable(library, description, environment)
        whole: CompileResult = result._replace(
            library=library,
            entry_point=entry,
            fndesc=description,
            environment=environment,
            metadata={},
        )
        for other in whole._find_referenced_environments():
            codegen.set_env(other.env_name, other)
        return whole


class Callback(NumbaCallback):
    """A compiled function that C, or compiled code that does not know it, calls by its address."""

    def __init__(self, function: Callable[..., Any], signature: Any, options: Any) -> None:
        super().__init__(function, normalize_signature(signature), locals={}, options=options)

    def _compile_uncached(self) -> CompileResult:
        with _translating():
            result: CompileResult = super()._compile_uncached()
        return result
