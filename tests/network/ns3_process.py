"""Carries frames through ns-3: `python ns3_process.py RESULT` pickles what became of them.

A process of its own, because ns-3's compiler must be loaded before HELICS, which other tests bring.
"""

import pickle
import sys
from pathlib import Path

import numpy as np

from network import test_engines
from network.builders import chain
from network.ns3_cases import CASES, fate
from tieline.errors import CosimError
from tieline.network.ns3 import Ns3Engine


def conformance() -> None:
    """Ask of ns-3 what every engine promises."""
    for name in test_engines.PROMISES:
        engine = Ns3Engine(test_engines.packet_network_spec(), 1)
        getattr(test_engines, name)(engine)
        engine.close()


def damage() -> str:
    """Return what the engine says when a byte of a frame changes on the way."""
    engine = Ns3Engine(chain([(10_000_000, 10**6)], overhead_bytes=2), 1)
    # Here, since ns-3's libraries come before its headers.
    import cppyy

    cppyy.cppdef(
        """
        #include "ns3/node-list.h"
        struct Damage : public ns3::ErrorModel
        {
            bool DoCorrupt(ns3::Ptr<ns3::Packet> packet) override
            {
                packet->RemoveAtEnd(1);
                uint8_t other = 8;
                packet->AddAtEnd(ns3::Create<ns3::Packet>(&other, 1));
                return false;
            }
            void DoReset() override {}
        };
        void DamageFramesAt(int node)
        {
            auto device = ns3::NodeList::GetNode(node)->GetDevice(1);
            device->GetObject<ns3::PointToPointNetDevice>()->SetReceiveErrorModel(
                ns3::CreateObject<Damage>());
        }
        """
    )
    cppyy.gbl.DamageFramesAt(1)
    engine.send(0, np.arange(1), 0, np.full((1, 34), 7, np.uint8))
    try:
        engine.run_until(10**9)
    except CosimError as error:
        return str(error)
    finally:
        engine.close()
    return "nothing"


def second() -> str:
    """Return what a second engine says while the first is open."""
    engine = Ns3Engine(chain([(10_000_000, 10**6)]), 1)
    try:
        Ns3Engine(chain([(10_000_000, 10**6)]), 1)
    except CosimError as error:
        return str(error)
    finally:
        engine.close()
    return "nothing"


if __name__ == "__main__":
    conformance()
    found = {name: fate(Ns3Engine, make()) for name, make in CASES.items()}
    said = {"damage": damage(), "second": second()}
    Path(sys.argv[1]).write_bytes(pickle.dumps((found, said)))
