/*
 * weft-protocol-docs PAGE: prints the page with the tables between its two marks written anew from
 * protocol.def.  A test compares, so docs/protocol.md cannot become stale.
 */
#include "firmware/fw_config.h"
#include "firmware/protocol.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char begin_mark[] = "<!-- tables of firmware/protocol.def -->\n";
static const char end_mark[] = "<!-- end of the tables -->\n";

/* A text of protocol.def as a sentence. */
static void print_sentence(const char *text)
{
    printf("\n%c%s.\n", toupper((unsigned char)text[0]), text + 1);
}

static int offset; /* of the next field */

static void print_field(const char *type, int bytes, const char *name, const char *text)
{
    if (offset == 0)
        puts("\n| offset | type | field | meaning |\n| ---: | --- | --- | --- |");
    printf("| %d | %s | `%s` | %s |\n", offset, type, name, text);
    offset += bytes;
}

static void end_payload(int bytes)
{
    if (bytes == 0)
        puts("\nNo payload.");
    else
        printf("\n%d bytes.\n", bytes);
}

/* A payload of protocol.def as a function that prints its table. */
#define WEFT_PAYLOAD_BEGIN(name, NAME)                                                                       \
    static void print_##name(void)                                                                           \
    {                                                                                                        \
        offset = 0;
#define WEFT_U8(field, text)  print_field("u8", 1, #field, text);
#define WEFT_U16(field, text) print_field("u16", 2, #field, text);
#define WEFT_U32(field, text) print_field("u32", 4, #field, text);
#define WEFT_BYTES(field, n, text)                                                                           \
    do {                                                                                                     \
        char type[16];                                                                                       \
        snprintf(type, sizeof type, "%d bytes", n);                                                          \
        print_field(type, n, #field, text);                                                                  \
    } while (0);
#define WEFT_PAYLOAD_END(name, NAME)                                                                         \
    end_payload(WEFT_##NAME##_BYTES);                                                                        \
    }
#include "firmware/protocol.def"

static void print_commands(void)
{
    puts("\n### Commands");
#define WEFT_COMMAND(opcode, NAME, name, text)                                                               \
    printf("\n#### 0x%02x %s\n", opcode, #NAME);                                                             \
    print_sentence(text);                                                                                    \
    puts("\nRequest:");                                                                                      \
    print_##name##_request();                                                                                \
    puts("\nReply, behind the status byte:");                                                                \
    print_##name##_reply();
#include "firmware/protocol.def"
    puts("\n### Events");
#define WEFT_EVENT(number, NAME, name, text)                                                                 \
    printf("\n#### 0x%02x %s\n", number, #NAME);                                                             \
    print_sentence(text);                                                                                    \
    print_##name##_event();
#include "firmware/protocol.def"
}

#define ROW(number, NAME, text) printf("| %d | %s | %s |\n", number, #NAME, text);

static void print_head(const char *title)
{
    printf("\n### %s\n\n| number | name | meaning |\n| ---: | --- | --- |\n", title);
}

static void print_numbers(void)
{
    print_head("Status bytes");
#define WEFT_STATUS ROW
#include "firmware/protocol.def"
    print_head("States");
#define WEFT_STATE ROW
#include "firmware/protocol.def"
    print_head("Causes of SAFE");
#define WEFT_CAUSE ROW
#include "firmware/protocol.def"
    print_head("Causes of a reset");
#define WEFT_RESET ROW
#include "firmware/protocol.def"
    print_head("States of the settings");
#define WEFT_SETTINGS ROW
#include "firmware/protocol.def"
    print_head("Why a sequence fails");
#define WEFT_FAULT ROW
#include "firmware/protocol.def"
    print_head("What ends a step");
#define WEFT_HOLD ROW
#include "firmware/protocol.def"
    print_head("Settings");
#define WEFT_KEY ROW
#include "firmware/protocol.def"
    printf("\n### Flags of a step\n\n| bit | name | meaning |\n| ---: | --- | --- |\n");
#define WEFT_STEP ROW
#include "firmware/protocol.def"
    printf("\n### Capability bits\n\n| bit | name | meaning |\n| ---: | --- | --- |\n");
#define WEFT_CAPABILITY ROW
#include "firmware/protocol.def"
}

static void print_tables(void)
{
    printf("\nProtocol %d.%d, as firmware %s speaks it.\n", WEFT_PROTOCOL_MAJOR, WEFT_PROTOCOL_MINOR,
           FW_VERSION_TEXT);
    printf(
        "\n### Limits\n\n| what | value |\n| --- | ---: |\n"
        "| line | %lu bits/s, 8N1 |\n| payload | 0 to %d bytes |\n| frame on the line | at most %d bytes |\n"
        "| lights | %d |\n| full level | %d |\n| tick | %lu Hz |\n| longest light | %d ms |\n"
        "| steps of a sequence | %d |\n| lease | %d to %d ms |\n| receive window | %d bytes |\n",
        FW_BAUD, WEFT_PAYLOAD_MAX, WEFT_FRAME_WIRE_MAX, FW_N_LIGHTS, FW_LEVEL_MAX, FW_TICK_HZ, FW_MAX_ON_MS,
        FW_MAX_STEPS, FW_LEASE_MIN_MS, FW_LEASE_MAX_MS, FW_RX_RING - 1);
    print_commands();
    print_numbers();
    putchar('\n');
}

int main(int argc, char **argv)
{
    static char page[1 << 18];
    FILE *const file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fputs("usage: weft-protocol-docs docs/protocol.md\n", stderr);
        return 2;
    }
    const size_t n = fread(page, 1, sizeof page - 1, file);
    fclose(file);
    page[n] = '\0';
    const char *const begin = strstr(page, begin_mark), *const end = begin ? strstr(begin, end_mark) : NULL;
    if (!end) {
        fprintf(stderr, "%s: the two marks are missing\n", argv[1]);
        return 1;
    }
    fwrite(page, 1, (size_t)(begin - page) + strlen(begin_mark), stdout);
    print_tables();
    fputs(end, stdout);
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
