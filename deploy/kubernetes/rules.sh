#!/usr/bin/env bash
# deploy/kubernetes/rules.sh | kubectl apply -n panelgate -f -
# The rules of deploy/prometheus/rules as the Prometheus operator wants them.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../prometheus/rules"
for rules in *.yml; do
    printf -- '---\napiVersion: monitoring.coreos.com/v1\nkind: PrometheusRule\nmetadata:\n  name: panelgate-%s\nspec:\n' "${rules%.yml}"
    sed 's/^/  /' "$rules"
done
