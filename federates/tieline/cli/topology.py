"""`tieline topology`: makes, imports, checks and draws topologies of the packet network."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tieline.console import reporting, say
from tieline.errors import InputError
from tieline.resources import case_folder, shipped

if TYPE_CHECKING:
    from tieline.network.spec import NetworkSpec
    from tieline.network.topologies.draft import Draft

topology = typer.Typer(
    name="topology",
    help="Make, import, check and draw topologies of the packet network.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Target = Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="the file to write")]
Force = Annotated[bool, typer.Option("--force", help="overwrite the file if it is there")]
Rate = Annotated[str, typer.Option(help="of links that do not say another, such as '20 Mbit/s'")]
Queue = Annotated[int, typer.Option(help="packets that may wait at each end of a link")]
Overhead = Annotated[int, typer.Option(help="bytes that the link layer adds to each packet")]
Propagation = Annotated[str | None, typer.Option(help="of every link, such as '2 ms'")]
Distance = Annotated[str | None, typer.Option(help="length of every link, such as '100 km'")]
File = Annotated[
    str,
    typer.Argument(metavar="FILE", help="a topology file, or CASE or CASE/NAME of a shipped one"),
]
OfCase = Annotated[
    str | None,
    typer.Option("--case", help="whose PMUs and controllers it serves; else that of its folder"),
]
Debug = Annotated[bool, typer.Option("--debug", help="show where in the code an error arose")]


@topology.command()
def new(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="star, ring, mesh, hierarchical or along-lines")
    ],
    out: Target,
    case: Annotated[
        str | None, typer.Argument(metavar="CASE", help="a shipped case, or a case's folder")
    ] = None,
    nodes: Annotated[
        int | None, typer.Option(help="substations of a generated network, in place of a case")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="of the places of generated nodes; else 1")
    ] = None,
    spacing: Annotated[
        str | None, typer.Option(help="between generated nodes, on average; else 50 km")
    ] = None,
    rate: Rate = "20 Mbit/s",
    queue: Queue = 200,
    overhead: Overhead = 9,
    propagation: Propagation = None,
    distance: Distance = None,
    hub: Annotated[str | None, typer.Option(help="star: its middle; else the central node")] = None,
    degree: Annotated[
        float | None, typer.Option(help="mesh: links of a node on average; else 3")
    ] = None,
    regions: Annotated[
        int | None, typer.Option(help="hierarchical: how many; else the case's areas")
    ] = None,
    ring_size: Annotated[
        int | None, typer.Option(help="hierarchical: routers in each regional ring")
    ] = None,
    core: Annotated[
        str | None, typer.Option(metavar="ring|mesh", help="hierarchical: shape of the core")
    ] = None,
    core_rate: Annotated[str | None, typer.Option(help="hierarchical: of core links")] = None,
    regional_rate: Annotated[str | None, typer.Option(help="hierarchical: of ring links")] = None,
    control_centres: Annotated[
        bool, typer.Option("--control-centres", help="hierarchical: one in each region")
    ] = False,
    cross_traffic: Annotated[
        bool, typer.Option("--cross-traffic", help="hierarchical: that of the control centres")
    ] = False,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Make a topology for a case, or of any size with --nodes."""
    with reporting(debug):
        from tieline.experiment.power_grid import power_grid
        from tieline.network.topologies import requests
        from tieline.network.topologies.generate import for_case, generated

        of_kind = {
            "hub": hub,
            "degree": degree,
            "regions": regions,
            "ring-size": ring_size,
            "core": core,
            "core-rate": core_rate,
            "regional-rate": regional_rate,
            "control-centres": control_centres or None,
            "cross-traffic": cross_traffic or None,
        }
        links = requests.link_defaults(rate, queue, overhead, propagation, distance)
        options = requests.options(kind, links, of_kind)
        size = requests.generated_size(case, nodes, seed, spacing)
        if size is not None:
            draft = generated(kind, *size, options)
        else:
            assert case is not None
            draft = for_case(kind, power_grid(case), options)
        _write(draft, out, force)


@topology.command("import")
def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a .graphml or .gml file")],
    out: Target,
    case: Annotated[str | None, typer.Option(help="a case whose buses stand at the nodes")] = None,
    buses: Annotated[Path | None, typer.Option(metavar="CSV", help="table of bus and node")] = None,
    spread: Annotated[
        bool, typer.Option("--spread", help="deal the case's stations to the nodes evenly")
    ] = False,
    factor: Annotated[float, typer.Option(help="cable length over great-circle distance")] = 1.5,
    missing: Annotated[
        str,
        typer.Option(metavar="refuse|neighbours|drop", help="nodes without coordinates"),
    ] = "refuse",
    largest: Annotated[
        bool, typer.Option("--largest", help="keep the largest of unconnected parts")
    ] = False,
    external: Annotated[
        bool, typer.Option("--external", help="keep nodes of other networks (Internal 0)")
    ] = False,
    rate: Rate = "1 Gbit/s",
    queue: Queue = 200,
    overhead: Overhead = 9,
    propagation: Propagation = None,
    distance: Distance = None,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Import a GraphML or GML file, such as those of the Internet Topology Zoo."""
    with reporting(debug):
        from tieline.experiment.power_grid import power_grid
        from tieline.network.topologies import assign, requests
        from tieline.network.topologies.graph_file import read_graph
        from tieline.network.topologies.importing import imported

        links = requests.link_defaults(rate, queue, overhead, propagation, distance)
        options = requests.import_options(links, factor, missing, external, largest)
        requests.refuse_assignment(case, buses is not None, spread)
        draft = imported(read_graph(file), options)
        if case is not None:
            grid = power_grid(case)
            draft = assign.by_table(draft, grid, buses) if buses else assign.evenly(draft, grid)
        _write(draft, out, force)


@topology.command()
def check(file: File, case: OfCase = None, debug: Debug = False) -> None:
    """Check a topology file, and show its size, delays and single points of failure."""
    with reporting(debug):
        from tieline.experiment.overrides import shortest
        from tieline.network.topologies.summary import lines_of, summary_of

        path, folder = _located(file, case)
        summary = summary_of(_spec(path, folder))
        served = f", and serves the case {folder.name}" if folder else ""
        say(f"{shortest(path)} is valid{served}")
        for line in lines_of(summary):
            say(line)


@topology.command()
def draw(
    file: File,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="PNG|SVG|PDF", help="else beside the file, as PNG"),
    ] = None,
    case: OfCase = None,
    title: Annotated[str | None, typer.Option(help="above the picture; else the file")] = None,
    debug: Debug = False,
) -> None:
    """Draw a topology: nodes, links by rate, PMUs, controllers and control centres."""
    with reporting(debug):
        from tieline.experiment.overrides import shortest
        from tieline.network.topologies.picture import write_picture

        path, folder = _located(file, case)
        target = out or Path(f"{path.stem}.png")
        heading = shortest(path) if title is None else title
        write_picture(_spec(path, folder), target, heading)
        say(str(target))


def _located(file: str, case: str | None) -> tuple[Path, Path | None]:
    """Return a topology's file, and the folder of the case that it serves, if any.

    Raises:
        InputError: there is no such file or case.
    """
    inside = shipped("cases") / file
    places = [Path(file), inside / "network.yaml", inside.with_name(f"{inside.name}.yaml")]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise InputError(
            f"no topology '{file}': give a file, a shipped case such as miniwecc, or one of a "
            "case's further topologies such as miniwecc/wan"
        )
    if case is not None:
        return path, case_folder(case)
    return path, path.parent if (path.parent / "case.yaml").is_file() else None


def _spec(path: Path, folder: Path | None) -> "NetworkSpec":
    """Return the network of a file, with the PMUs and controllers of a case if there is one."""
    from tieline.network.settings import NetworkSettings
    from tieline.network.topology import read_topology

    sources: Sequence[Mapping[str, Any]] = ()
    destinations: Sequence[Mapping[str, Any]] = ()
    if folder is not None:
        from tieline.experiment.power_grid import power_grid
        from tieline.experiment.sites import Sites

        grid = power_grid(str(folder))
        sites = Sites(grid.pmus, grid.controllers)
        sources, destinations = sites.sources(), sites.destinations()
    return read_topology(path, sources, destinations, NetworkSettings())  # type: ignore[call-arg]


def _write(draft: "Draft", out: Path, has_leave: bool) -> None:
    from tieline.network.topologies.write import write_draft

    write_draft(draft, out, has_leave)
    say(f"{out}: {len(draft.nodes)} nodes, {len(draft.links)} links")
