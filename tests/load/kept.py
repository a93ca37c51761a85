"""What a service says that it keeps on purpose."""

from __future__ import annotations

import httpx
from prometheus_client.parser import text_string_to_metric_families

KEPT = "gazetrace_held_bytes"


async def kept_bytes(client: httpx.AsyncClient) -> int:
    """Its cell maps, samples and scenes by now, which are bounded; `client` asks that service."""
    reply = await client.get("/metrics")
    assert reply.status_code == 200, reply.text
    families = text_string_to_metric_families(reply.text)
    return int(sum(sample.value for family in families for sample in family.samples if sample.name == KEPT))
