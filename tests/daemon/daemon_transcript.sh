#!/usr/bin/env bash
# The daemon as a person with curl meets it: a capture is begun, followed, cancelled, resumed, solved and looked at,
# while fifty clients watch, one of them never reads, and one sends its request a letter at a time; and everybody who
# should be refused is.  What it prints is the transcript in docs/daemon.md.
set -u
# shellcheck source=tests/support/rig.sh
. "$WEFT_TEST_SOURCE/tests/support/rig.sh"
command -v curl >/dev/null || { echo "skipped: no curl"; exit 77; }

socket=$dir/weftd.sock
library=$dir/library
watchers=()

# shellcheck disable=SC2317 # called by the trap
end_all() {
    kill "${watchers[@]}" 2>/dev/null
    [ -z "${daemon:-}" ] || kill "$daemon" 2>/dev/null
    wait "${daemon:-}" 2>/dev/null
    clean_up
}
trap end_all EXIT

# What follows builds on what was before.
fail() {
    echo "FAILED: $*"
    exit 1
}

# api WORDS...: asks; the status goes to $dir/status, the body to $dir/body, both to the transcript
api() {
    echo "\$ api $*" | sed "s|$dir/||g"
    curl -sS --unix-socket "$socket" -H 'Content-Type: application/json' -o "$dir/body" -w '%{http_code}' "$@" >"$dir/status"
    echo "$(<"$dir/status") $(head -c 600 "$dir/body" | tr -d '\0' | sed "s|$dir/||g" | cut -c1-300)"
}

# wanted STATUS [FILTER]: of the last answer; the filter is of jq and must be true of its body
wanted() {
    [ "$(<"$dir/status")" = "$1" ] || fail "it is $(<"$dir/status"), not $1: $(head -c 300 "$dir/body")"
    [ $# = 1 ] || jq -e "$2" "$dir/body" >/dev/null 2>&1 || fail "not $2: $(head -c 600 "$dir/body")"
}

# wait_for FILE PATTERN [SECONDS]: until a line of the file has it
wait_for() {
    local end=$((SECONDS + ${3:-60}))
    until grep -qe "$2" "$1" 2>/dev/null; do
        [ $SECONDS -lt $end ] || { fail "$1: no $2: $(tail -c 500 "$1")"; }
        sleep 0.05
    done
}

wait_for_state() { # JOB STATE
    local end=$((SECONDS + 60)) state
    until state=$(curl -sS --unix-socket "$socket" "http://localhost/v1/jobs/$1" | jq -r .state) && [ "$state" = "$2" ]; do
        [ $SECONDS -lt $end ] || { fail "job $1 is $state, not $2"; }
        sleep 0.05
    done
}

start_twill
mkdir "$library"
tell "truth $dir/truth" >/dev/null
cp -r "$dir/truth/truth.cal" "$library/scanner.cal"
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
"$WEFT_TEST_BIN/weftd" --library "$library" --socket "$socket" --listen "127.0.0.1:$port" --rig "$dir/rig" --verbose \
    2>"$dir/weftd.log" 9>&- &
daemon=$!
wait_for "$dir/weftd.log" "serves"
begun=$SECONDS

# ---- one that never reads: more events than its pipe and its socket hold, of jobs with long lists of operands ----
mkfifo "$dir/deaf"
# shellcheck disable=SC2217 # that it does not read is the point
sleep 100 <"$dir/deaf" 9>&- &
watchers+=($!)
curl -sN --unix-socket "$socket" http://localhost/v1/events >"$dir/deaf" 9>&- &
watchers+=($!)
post=(--unix-socket "$socket" http://localhost/v1/jobs -H 'Content-Type: application/json')
operands=$(seq -f '"a-set-that-is-not-there-at-all-number-%g.set"' 1000 | paste -sd,)
echo "{\"command\":\"solve\",\"operands\":[$operands],\"options\":{\"calibration\":\"none.cal\",\"output\":\"x\"}}" >"$dir/long"
for _ in $(seq 8); do
    curl -sS "${post[@]}" --data-binary "@$dir/long" -o "$dir/body" -w '%{http_code}' >"$dir/status"
    wanted 201
done

# ---- a letter at a time ----
(
    trap '' PIPE
    exec 3<>"/dev/tcp/127.0.0.1/$port"
    cat <&3 >"$dir/slow" &
    printf 'GET /v1 HTTP/1.1\r\nHost: loc' >&3
    while kill -0 $! && [ $SECONDS -lt $((begun + 60)) ]; do
        printf a >&3
        sleep 0.5
    done
    printf '\nafter %d s\n' $((SECONDS - begun)) >>"$dir/slow"
) 2>/dev/null 9>&- &
slow=$!

# ---- fifty that watch ----
wait_for_state 8 failed
for i in $(seq 50); do
    curl -sN --unix-socket "$socket" http://localhost/v1/events >"$dir/events.$i" 9>&- &
    watchers+=($!)
done
for i in $(seq 50); do
    wait_for "$dir/events.$i" "event: snapshot"
done

# ---- a capture ----
api http://localhost/v1/jobs -d '{"command":"capture","operands":["twill.set"],"options":{"exposure":0.15}}'
wanted 201 '.id == 9 and .class == "hardware"'
curl -sN --unix-socket "$socket" 'http://localhost/v1/events?job=9' >"$dir/events" 9>&- &
watchers+=($!)
wait_for "$dir/events.1" '"done":2'
api -X POST http://localhost/v1/jobs/9/cancel
wanted 202 '.cancelling or .state == "cancelled"'
wait_for_state 9 cancelled
expect_dark "cancel"
check_files "$library/twill.set" capturing 2
api -X POST http://localhost/v1/jobs/9/resume
wanted 202 '.state == "queued" or .state == "running"'
# queued at once: each waits for what it reads
api http://localhost/v1/jobs -d '{"command":"solve","operands":["twill.set"],"options":{"calibration":"scanner.cal","output":"twill.maps","method":"lsq","resolution":"half"}}'
wanted 201
api http://localhost/v1/jobs -d '{"command":"preview","operands":["twill.maps"],"options":{"output":"twill.png","light":[135,35]}}'
wanted 201
wait_for_state 11 "done"
check_files "$library/twill.set" complete 11
api http://localhost/v1/jobs/9
wanted 200 '.state == "done" and .attempt == 2 and .result.kept >= 2'
api http://localhost/v1/files/twill.png | head -1
wanted 200
cmp -s "$dir/body" "$library/twill.png" || fail "twill.png is not what was made"
[ "$(head -c 8 "$dir/body" | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] || fail "twill.png is no PNG"

# ---- what the fifty have heard: the same, all of it ----
for i in $(seq 50); do
    wait_for "$dir/events.$i" '"id":11,.*"state":"done"'
    grep -e '^id:' -e '"state":' -e '"stream":' "$dir/events.$i" >"$dir/heard.$i"
    cmp -s "$dir/heard.$i" "$dir/heard.1" || fail "watchers 1 and $i hear different things"
done
jq -nRr '[inputs | select(startswith("data: ")) | .[6:] | fromjson | select(.id == 9) | .state] | unique | join(" ")' \
    "$dir/heard.1" | grep -qx "cancelled done queued running" || fail "the states are not all there"
echo "50 watchers have heard $(grep -c '^id:' "$dir/events.1") events each"
echo "$ api -N 'http://localhost/v1/events?job=9'"
grep -v '^$' "$dir/events" | cut -c1-150 | sed "s|$dir/||g" | sed -n '1,12p'

# ---- the token, the host, the origin ----
url=http://127.0.0.1:$port/v1
token=$(<"$library/.weft/token")
ask() {
    echo "\$ curl $*" | sed "s|$token|TOKEN|g; s|$dir/||g; s|:$port|:8080|g"
    curl -sS -o "$dir/body" -w '%{http_code}' "$@" >"$dir/status"
    echo "$(<"$dir/status") $(head -c 300 "$dir/body" | sed "s|$dir/||g")"
}
ask "$url"
wanted 401 '.error.code == "no_token"'
ask "$url" -H "Authorization: Bearer $token"
wanted 200 '.name == "weftd"'
ask "$url" -H "Authorization: Bearer $token" -H 'Host: evil.example'
wanted 421 '.error.code == "foreign_host"'
ask "$url" -H "Authorization: Bearer $token" -H 'Origin: http://evil.example'
wanted 403 '.error.code == "foreign_origin"'
ask --unix-socket "$socket" http://evil.example/v1
wanted 421 '.error.code == "foreign_host"'

# ---- out of the library, too large, no JSON ----
head -c 100000 /dev/zero | tr '\0' ' ' >"$dir/large"
ask --unix-socket "$socket" --path-as-is http://localhost/v1/files/../../../etc/passwd
wanted 403 '.error.message | test("leads out of the library")'
ask --unix-socket "$socket" http://localhost/v1/files/%2e%2e%2f%2e%2e%2fetc%2fpasswd
wanted 403 '.error.code == "forbidden"'
ask "${post[@]}" -d '{"command":"import","operands":["x"],"options":{"output":"../x.set"}}'
wanted 403 '.error.code == "forbidden"'
ask "${post[@]}" --data-binary "@$dir/large"
wanted 413 '.error.code == "body_too_large"'
ask "${post[@]}" -d '{"command":'
wanted 400 '.error.code == "bad_json"'
ask "${post[@]}" -H 'Content-Length: five' -d '{}'
wanted 400 '.error.code == "bad_http"'

# ---- the one that never reads is let go, and the slow one gets its answer ----
wait_for "$dir/weftd.log" "a watcher is dropped: \(it takes nothing\|overrun\)"

wait $slow
grep -q '"code":"too_slow"' "$dir/slow" || fail "the slow one hears: $(<"$dir/slow")"
echo "a request sent a letter at a time: $(sed -n '1p;$p' "$dir/slow" | tr -d '\r' | paste -sd' ')"
kill "${watchers[@]}" 2>/dev/null
kill -TERM "$daemon"
wait "$daemon" || fail "weftd ends with $?"
daemon=
finish
