"""The long forms: `python -m tests.hostile http` and `python -m tests.hostile stream`."""

from __future__ import annotations

import argparse

from tests.hostile.requests import ask
from tests.hostile.state import FLAGS, Before
from tests.hostile.stream import attack
from tests.service.process import service_process


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description=__doc__)
    parser.add_argument("what", choices=("http", "stream"))
    parser.add_argument("--cases", type=int, default=10_000, help="requests (default %(default)s)")
    parser.add_argument("--messages", type=int, default=100_000, help="messages (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="another one makes up others (default %(default)s)")
    arguments = parser.parse_args()
    with service_process(*FLAGS) as service:
        before = Before(service)
        if arguments.what == "http":
            asked = ask(service.address, arguments.cases, arguments.seed)
            print(f"{asked.statuses.total():,} requests, {len(asked.wrong)} answered wrongly")
            for operation, count in sorted(asked.operations.items()):
                print(f"{count:8,}  {operation}")
            print("statuses", dict(sorted(asked.statuses.items())))
            assert not asked.wrong, "\n\n".join(asked.wrong)
        else:
            attacked = attack(service.address, arguments.messages, arguments.seed)
            print(f"{attacked.sent:,} messages; connections ended, by close code: {dict(attacked.closes)}")
            assert not attacked.mistakes, attacked.mistakes[:20]
        print(before.check())


if __name__ == "__main__":
    main()
