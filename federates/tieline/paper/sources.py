"""Where the statements on the paper come from. Its full text was not at hand: no figure or table
number is confirmed, and figures are named by their content."""

from tieline.paper.statement import Source

PAPER = (
    "R. T. Elliott, P. Arabshahi and D. S. Kirschen, 'A Generalized PSS Architecture for Balancing "
    "Transient and Small-Signal Response', IEEE Transactions on Power Systems, arXiv:1908.10338"
)

ABSTRACT = Source("abstract", "the abstract of the paper, arXiv:1908.10338")
DESIGN = Source(
    "design notes", "the paper's control law and tunings as tieline's design notes (section 1) tell"
)
TWO_AREA = Source(
    "notes on the two-area system",
    "the paper's statements on the two-area system and on loads, as the task that brought that "
    "system into tieline quotes them",
)
LINEAR = Source(
    "notes on linear analysis",
    "the paper's statements on modes, root loci and open loops, as the task that brought linear "
    "analysis into tieline quotes them",
)
TRIP = Source(
    "notes on the trip of G26",
    "the paper's observation on the trip of G26 under delay, as the task that brought that trip "
    "into tieline quotes it; the bounds are that task's",
)
REFERENCE = Source(
    "notes on the reference runs",
    "where the paper's words and the numbers of its author's toolbox part, as noted with the runs "
    "of that toolbox for tieline",
)
PSTESS = Source(
    "PSTess 1.1",
    "no statement of the paper but numbers of its first author's toolbox, PSTess 1.1, on the same "
    "data (cases/*/expected)",
)

SOURCES = (ABSTRACT, DESIGN, TWO_AREA, LINEAR, TRIP, REFERENCE, PSTESS)
"""All of them, in the order in which a page lists them."""
