"""Ray in tests: no port beyond the loopback interface, nothing sent to anybody, one cluster for all."""

import os
from collections.abc import Iterator
from typing import Any

import pytest

os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # Ray reads it when it is imported
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

SMALL = {"num_cpus": 1, "object_store_memory": 10**8}


@pytest.fixture(scope="session")
def cluster() -> Iterator[Any]:
    """Give a cluster of one node with one CPU; tests add others, and kill them."""
    utils = pytest.importorskip("ray.cluster_utils")
    head = {**SMALL, "include_dashboard": False}
    found = utils.Cluster(initialize_head=True, head_node_args=head)
    try:
        yield found
    finally:
        found.shutdown()


@pytest.fixture
def node(cluster: Any) -> Iterator[Any]:
    """Give a second node of it; it may be killed."""
    found = cluster.add_node(**SMALL)
    yield found
    if found in cluster.list_all_nodes():
        cluster.remove_node(found)
