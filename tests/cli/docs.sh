#!/usr/bin/env bash
# The documents that the program writes are not stale.
set -u
status=0
for page in cli errors; do
    if ! "$WEFT_TEST_BIN/weft-docs" $page | diff -u "$WEFT_TEST_SOURCE/docs/$page.md" - ; then
        echo "docs/$page.md is stale: build/bin/weft-docs $page > docs/$page.md"
        status=1
    fi
done
exit $status
