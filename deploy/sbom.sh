#!/usr/bin/env bash
# deploy/sbom.sh rows [PACKAGE...]   what dpkg has installed (of these packages), one a line:
#                                    name, version, architecture, source, its version; tabs between
#                                    DPKG_ADMINDIR: of another folder than /var/lib/dpkg
# deploy/sbom.sh cyclonedx [VERSION] such rows from stdin as a bill of materials, CycloneDX 1.5 JSON: of
#                                    panelgate VERSION
# Package and image have their own as /usr/share/panelgate/sbom.cdx.json; without running anything:
#   docker create --name x panelgate && docker cp x:/usr/share/panelgate/sbom.cdx.json . && docker rm x
set -euo pipefail

rows() {
    dpkg-query -W -f '${db:Status-Status}\t${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\n' "$@" |
        awk -F '\t' -v OFS='\t' '$1 == "installed" { print $2, $3, $4, $5, $6 }'
}

# Names and versions of Debian hold nothing that JSON escapes; a purl escapes + and :
cyclonedx() {
    awk -F '\t' -v version="${1-}" '
        function escaped(text) { gsub(/\+/, "%2B", text); gsub(/:/, "%3A", text); return text }
        BEGIN { printf "{\"bomFormat\": \"CycloneDX\", \"specVersion\": \"1.5\", \"version\": 1, "
            if (version != "")
                printf "\"metadata\": {\"component\": {\"type\": \"application\", \"name\": \"panelgate\", \"version\": \"%s\"}}, ", version
            printf "\"components\": [" }
        {
            purl = "pkg:deb/debian/" escaped($1) "@" escaped($2) "?arch=" $3 "&distro=debian-12"
            printf "%s\n  {\"type\": \"library\", \"bom-ref\": \"%s\", \"name\": \"%s\", \"version\": \"%s\", \"purl\": \"%s\", ",
                (NR > 1 ? "," : ""), purl, $1, $2, purl
            printf "\"properties\": [{\"name\": \"debian:source\", \"value\": \"%s %s\"}]}", $4, $5
        }
        END { print "\n]}" }'
}

case "${1-}" in
    rows) shift; rows "$@" ;;
    cyclonedx) shift; cyclonedx "$@" ;;
    *) sed -n '2,8s/^# //p' "$0" >&2; exit 64 ;;
esac
