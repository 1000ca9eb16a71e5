#!/bin/sh
# The table of errors against run time in docs/results.md: runs the studies beside the cases where OUT does not have them, and takes from
# each the front (no other run is both better and faster) and the orders.
# usage: studies.sh SILT OUT [CASE...]
#   CASE default: all cases/*/study.yaml; without SILT ("") nothing is run
set -u
[ $# -ge 2 ] || { sed -n '4s/^# //p' "$0" >&2; exit 2; }
silt=$1 out=$2
shift 2
top=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd -P)
[ $# -gt 0 ] || set -- $(cd "$top/cases" && ls -d */study.yaml | sed 's#/study.yaml##')
bad=0
LC_ALL=C
export LC_ALL
echo '`silt study cases/CASE/study.yaml` ([study.md](study.md)), seconds of one processor. The front: runs than which no other is both better and faster,'
printf 'at most five of them. Which default each supports stands beside its plot in the case.\n\n'
echo '| case | check | front: error in seconds | order |'
echo '|---|---|---|---|'
for case; do
    study=$top/cases/$case/study.yaml
    result=$out/study-$case
    [ -z "$silt" ] || "$silt" study "$study" -o "$result" -q >"$result.txt" 2>&1 || bad=1
    if [ ! -e "$result/study.csv" ]; then
        printf '| [%s](../cases/%s/README.md) | | not run | |\n' "$case" "$case"
        continue
    fi
    check=$(sed -n 's/.*kind: time,.*check: \([a-z_A-Z0-9]*\).*/\1/p' "$study" | head -n 1)
    order=$(sed -n 's/^study_h: .*power \([-0-9.]*\) (.*, \(.*\))$/\1 at \2/p' "$result/study.md" | paste -sd ';' | sed 's/;/; /g')
    front=$(awk -F, -v check="$check" '
        NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
        $c["status"] ~ /ok|cut/ && $c[check "_error"] != "" { n++; error[n] = $c[check "_error"] < 0 ? -$c[check "_error"] : $c[check "_error"]; cpu[n] = $c["cpu_seconds"] }
        END {
            for (i = 1; i <= n; i++) for (k = i + 1; k <= n; k++) if (cpu[k] < cpu[i]) { t = cpu[i]; cpu[i] = cpu[k]; cpu[k] = t; t = error[i]; error[i] = error[k]; error[k] = t }
            for (i = 1; i <= n; i++) if (i == 1 || error[i] < least) { least = error[i]; m++; e[m] = error[i]; s[m] = cpu[i] }
            for (i = 1; i <= m; i++)
                if (m <= 5 || i == 1 || i == m || int((i - 1) * 4 / (m - 1)) != int((i - 2) * 4 / (m - 1)))
                    printf("%s%.2g in %.2g s", (i > 1 ? "; " : ""), e[i], s[i])
        }' "$result/study.csv")
    printf '| [%s](../cases/%s/README.md) | %s | %s | %s |\n' "$case" "$case" "$check" "$front" "$order"
done
exit $bad
