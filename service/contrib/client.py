#!/usr/bin/env python3
"""Keeps a copy of the plan that `plan serve --http` holds, and says that a drone is late.

    plan serve --http 127.0.0.1:8080 --journal site.jsonl &
    python3 client.py http://127.0.0.1:8080 warehouse.ron DRONE

With a token: LEEWARD_TOKEN=... python3 client.py ... The standard library alone.
"""

import json
import os
import sys
import threading
import urllib.error
import urllib.request


class Refused(Exception):
    """What `error` of an answer says: `code`, `message`, `place`."""

    def __init__(self, error):
        super().__init__("{code}: {message} ({place})".format(**error))
        self.error = error


class Planner:
    """A planner over HTTP, and the trajectories that it wants flown."""

    def __init__(self, url, token=None):
        self.url = url
        self.headers = {"Content-Type": "application/json"}
        if token:
            self.headers["Authorization"] = f"Bearer {token}"
        self.revision = 0
        #: By drone: `t_s`, `position_m` and `mass_kg`, and `control_m` where it is smooth.
        self.trajectories = {}
        self.changed = threading.Condition()

    def ask(self, method, **params):
        """The result of a request, or Refused."""
        request = {"method": method, **({"params": params} if params else {})}
        request = urllib.request.Request(
            f"{self.url}/v1/requests", json.dumps(request).encode(), self.headers
        )
        try:
            with urllib.request.urlopen(request) as response:
                return json.load(response)["result"]
        except urllib.error.HTTPError as error:
            raise Refused(json.load(error)["error"]) from None

    def follow(self):
        """Takes over the plan, then every patch, until the server ends. Listens first, so that
        nothing happens in between; what the plan has already is passed over."""
        request = urllib.request.Request(f"{self.url}/v1/events", headers=self.headers)
        with urllib.request.urlopen(request) as stream:
            self.take_plan()
            kind = None
            for line in stream:
                field, _, value = line.decode().rstrip("\n").partition(": ")
                if field == "event":
                    kind = value
                elif field == "data":
                    self.take(kind, json.loads(value))

    def take_plan(self):
        try:
            whole = self.ask("plan")
        except Refused as refused:
            if refused.error["code"] != "not_open":
                raise
            whole = {"revision": 0, "plan": {"drones": []}}
        with self.changed:
            drones = whole["plan"]["drones"]
            self.trajectories = {drone["name"]: drone["trajectory"] for drone in drones}
            self.revision = whole["revision"]
            self.changed.notify_all()

    def take(self, kind, data):
        if kind == "patch":
            with self.changed:
                if data["revision"] > self.revision:
                    for drone in data["changed"]:
                        self.trajectories[drone["drone"]] = drone["trajectory"]
                    self.revision = data["revision"]
                self.changed.notify_all()
        else:  # opened, closed, ask_plan
            self.take_plan()


def main(url, scenario, drone):
    token = os.environ.get("LEEWARD_TOKEN")
    planner = Planner(url, token)
    with open(scenario, encoding="utf-8") as file:
        planner.ask("open", scenario=file.read())
    threading.Thread(target=planner.follow, daemon=True).start()
    with planner.changed:
        planner.changed.wait_for(lambda: planner.revision == 1)
    late = {"late": {"drone": drone, "by_s": 0.8}}
    try:
        planner.ask("change", revision=7, at_s=1.0, changes=[late])
    except Refused as refused:
        print(f"refused: {refused}")
    planner.ask("change", revision=planner.revision, at_s=1.0, changes=[late], time_limit_s=10)
    with planner.changed:
        planner.changed.wait_for(lambda: planner.revision == 2)
    trajectory = planner.trajectories[drone]
    print(f"revision {planner.revision}: {drone} ends at {trajectory['position_m'][-1]}", end=" ")
    print(f"at {trajectory['t_s'][-1]} s")
    landing = planner.ask("land_all", at_s=2.0)
    print(f"revision {landing['revision']}: not landing: {landing['not_landing']}")


if __name__ == "__main__":
    main(*sys.argv[1:])
