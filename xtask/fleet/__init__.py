"""A fleet of servers under faults: hosts, services and clients in network namespaces of one machine."""
