"""Entry point of ``python -m bench_service`` and ``bench``: the environment is read here, once."""

import os
import sys


def main() -> None:
    """Run the command line and exit with its code."""
    if sys.argv[1:2] == ["stop"]:  # it loads no more than it needs, and reads no setting that it does not need
        from bench_service.cli.processes.stopping import stop_command

        sys.exit(stop_command(sys.argv[2:], os.environ))
    from bench_service.collector import no_collection

    with no_collection():
        from bench_service.cli.commands import run_command_line
        from bench_service.settings import BadSettings, Settings

    try:
        settings = Settings.from_environ(os.environ)
    except BadSettings as error:
        print(f"bench: {error}", file=sys.stderr)
        sys.exit(2)
    sys.exit(run_command_line(settings))


if __name__ == "__main__":
    main()
