#!/usr/bin/env bash
# run.sh GART FOLDER [CASE...]: the browser tests of the page, against a built gart. playwright-core goes to FOLDER, where
# it stays. Exit code 77, with the reason, where something is not here that they need.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
gart=$1 folder=$2
shift 2
skip() {
  echo "skipped: $*"
  exit 77
}
"$gart" info | grep -q '^embree .*not in this build' && skip "this gart makes no capture (it was built without Embree)"
for program in node npm chromium; do
  command -v "$program" >/dev/null || skip "$program is not here (apt-get install nodejs npm chromium)"
done
mkdir -p "$folder"
# npm writes its own lock last: what was fetched in part is fetched again.
if [[ ! -f $folder/node_modules/.package-lock.json ]] || ! cmp -s "$here/package-lock.json" "$folder/package-lock.json"; then
  cp "$here/package.json" "$here/package-lock.json" "$folder"
  (cd "$folder" && timeout 120 npm ci --no-audit --no-fund --silent --prefer-offline --fetch-retries=1 --fetch-timeout=20000) ||
    skip "npm could not fetch playwright-core (is there a network?)"
fi
exec node "$here/run.mjs" "$gart" "$folder" "$(command -v chromium)" "$@"
