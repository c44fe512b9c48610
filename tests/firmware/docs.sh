#!/usr/bin/env bash
# The tables of docs/protocol.md are those of firmware/protocol.def.
page=$WEFT_TEST_SOURCE/docs/protocol.md
if ! "$WEFT_TEST_BIN/weft-protocol-docs" "$page" | diff -u "$page" -; then
    echo "docs/protocol.md is stale: build/bin/weft-protocol-docs docs/protocol.md > new && mv new docs/protocol.md"
    exit 1
fi
