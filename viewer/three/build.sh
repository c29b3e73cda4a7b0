#!/usr/bin/env bash
# Bundles what plan.html uses of three.js into viewer/page/three.min.js. Needs node and npm; run by
# hand when three.js or the list in three.js changes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
npm ci
npx esbuild three.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
  --legal-comments=eof --outfile=../page/three.min.js
