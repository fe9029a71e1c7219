"""Network namespaces on one bridge, and cuts between them."""

from __future__ import annotations

from fleet.shell import attempt, run

PREFIX = "palmares-"
BRIDGE = PREFIX + "bridge"
# The machine's own address on the bridge.
OWN = "10.77.0.1"


class Network:
    """Namespaces, each with one address.

    The bridge has a namespace of its own, so that no rule of the machine's firewall applies.
    """

    def __init__(self) -> None:
        self.close()
        self.addresses: dict[str, str] = {}
        run("ip", "netns", "add", BRIDGE)
        for words in ("link add br0 type bridge", "link set br0 up", "link set lo up"):
            run("ip", "netns", "exec", BRIDGE, "ip", *words.split())
        self._plug("pm-own", None)
        run("ip", "address", "add", f"{OWN}/24", "dev", "pm-own")
        run("ip", "link", "set", "pm-own", "up")

    def add(self, name: str, address: str) -> None:
        """Add a namespace."""
        self.addresses[name] = address
        space = PREFIX + name
        run("ip", "netns", "add", space)
        self._plug(f"pm-{name}", space)
        for words in (f"address add {address}/24 dev eth0", "link set eth0 up", "link set lo up"):
            run(*self.inside(name), "ip", *words.split())

    def _plug(self, device: str, space: str | None) -> None:
        """Connect a new device to the bridge, here or as eth0 of a namespace."""
        here = ["netns", space] if space else []
        name = "eth0" if space else device
        run("ip", "link", "add", name, *here, "type", "veth", "peer", "name", device + "-b", "netns", BRIDGE)
        for words in (f"link set {device}-b master br0", f"link set {device}-b up"):
            run("ip", "netns", "exec", BRIDGE, "ip", *words.split())

    def inside(self, name: str) -> list[str]:
        """Return the words before a program that runs in a namespace."""
        return ["ip", "netns", "exec", PREFIX + name]

    def cut(self, name: str, other: str) -> None:
        """Drop all packets between two namespaces, silently as a pulled cable does."""
        address = self.addresses[other]
        rules = f"""table inet {self._table(other)} {{
            chain in {{ type filter hook input priority 0; ip saddr {address} drop; }}
            chain out {{ type filter hook output priority 0; ip daddr {address} drop; }}
        }}"""
        run(*self.inside(name), "nft", "-f", "-", text=rules)

    def heal(self, name: str, other: str) -> None:
        """End a cut."""
        attempt(*self.inside(name), "nft", "delete", "table", "inet", self._table(other))

    @staticmethod
    def _table(other: str) -> str:
        return "cut_" + other

    def close(self) -> None:
        """Remove all namespaces, also those of an earlier run that was killed."""
        for line in run("ip", "netns", "list").splitlines():
            space = line.split()[0]
            if space.startswith(PREFIX):
                attempt("ip", "netns", "delete", space)
        attempt("ip", "link", "delete", "pm-own")
