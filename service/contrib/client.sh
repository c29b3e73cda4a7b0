#!/bin/sh
# Opens a scenario with `plan serve --http`, says that a drone is late, and lands all.
#   plan serve --http 127.0.0.1:8080 --journal site.jsonl &
#   sh client.sh http://127.0.0.1:8080 warehouse.ron DRONE
# With a token: LEEWARD_TOKEN=... sh client.sh ... Needs curl and python3 (to write JSON).
set -eu
url=$1 scenario=$2 drone=$3

# Prints an answer; a refusal ends the script with what it says.
ask() {
  set -- --silent --show-error --fail-with-body \
    --header 'Content-Type: application/json' --data-binary @- "$url/v1/requests"
  [ -z "${LEEWARD_TOKEN:-}" ] || set -- --header "Authorization: Bearer $LEEWARD_TOKEN" "$@"
  curl "$@"
}

# The scenario as a JSON string.
text=$(python3 -c 'import json, sys; print(json.dumps(open(sys.argv[1]).read()))' "$scenario")
printf '{"method": "open", "params": {"scenario": %s}}' "$text" | ask
printf '{"method": "change", "params": {"revision": 1, "at_s": 1, "time_limit_s": 10,
  "changes": [{"late": {"drone": "%s", "by_s": 0.8}}]}}' "$drone" | ask
printf '{"method": "land_all", "params": {"at_s": 2}}' | ask
printf '{"method": "close"}' | ask
