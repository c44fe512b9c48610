/* What is in the flash memory of the simulated chip: a firmware, a bootloader, both, or nothing. */
#include "core/formats/ihex_file.h"
#include "host/rig/controller_sim_private.h"

#include <simavr/sim_elf.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ELF_MACHINE_AVR = 83 };

/* libsimavr says little about a file that it does not like. */
static weft_err look_at_file(const char *path, bool *is_hex, weft_error *err)
{
    unsigned char head[20] = {0};
    FILE *const file = fopen(path, "rb");
    if (!file)
        return weft_fail_errno(err, WEFT_ERR_IO,
                               "%s: the firmware cannot be read (the build makes it: "
                               "cmake --build build --target weft_firmware)",
                               path);
    const size_t n = fread(head, 1, sizeof head, file);
    fclose(file);
    *is_hex = head[0] == ':';
    if (*is_hex)
        return WEFT_OK;
    if (n != sizeof head || memcmp(head, "\177ELF\1\1", 6) != 0 || head[18] != ELF_MACHINE_AVR)
        return weft_fail(err, WEFT_ERR_FORMAT,
                         "%s: this is no firmware for an AVR (wanted its .elf or .hex file)", path);
    return WEFT_OK;
}

/* `ram_free` gets the end of the program's variables; 0 when the file does not say. */
static weft_err load_elf(avr_t *avr, const char *path, uint32_t *ram_free, weft_error *err)
{
    elf_firmware_t elf;
    memset(&elf, 0, sizeof elf);
    const int failed = elf_read_firmware(path, &elf) != 0 || elf.flashsize == 0 ||
                       elf.flashbase + elf.flashsize > avr->flashend + 1;
    if (!failed) {
        elf.frequency = WEFT_SIM_CLOCK_HZ;
        avr_load_firmware(avr, &elf);
    }
    *ram_free = 0;
    for (uint32_t i = 0; i < elf.symbolcount; i++) {
        if (strcmp(elf.symbol[i]->symbol, "_end") == 0)
            *ram_free = elf.symbol[i]->addr & 0xffff;
        free(elf.symbol[i]);
    }
    free(elf.symbol);
    free(elf.flash);
    free(elf.eeprom);
    if (failed)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: the firmware is damaged or does not fit the ATmega328P",
                         path);
    return WEFT_OK;
}

static weft_err load_hex(avr_t *avr, const char *path, uint32_t *begin, weft_error *err)
{
    uint32_t end;
    return weft_ihex_read(path, avr->flash, avr->flashend + 1, begin, &end, err);
}

/* The boot sections that the fuses of an ATmega328P can choose begin here and end with the flash
 * (DS40002061B, table 27-13). */
static weft_err check_boot_section(const char *path, uint32_t base, weft_error *err)
{
    if (base == 0x7000 || base == 0x7800 || base == 0x7c00 || base == 0x7e00)
        return WEFT_OK;
    return weft_fail(
        err, WEFT_ERR_FORMAT,
        "%s: no bootloader for an ATmega328P: it begins at %#x, not at 0x7000, 0x7800, 0x7c00 or 0x7e00",
        path, (unsigned)base);
}

weft_err weft_sim_load(weft_controller_sim *sim, const weft_controller_sim_program *program, weft_error *err)
{
    bool is_hex;
    uint32_t base = 0;
    if (program->firmware) {
        WEFT_TRY(look_at_file(program->firmware, &is_hex, err));
        WEFT_TRY(is_hex ? load_hex(sim->avr, program->firmware, &base, err)
                        : load_elf(sim->avr, program->firmware, &sim->ram_free, err));
    }
    if (!program->bootloader)
        return WEFT_OK;
    WEFT_TRY(look_at_file(program->bootloader, &is_hex, err));
    if (!is_hex)
        return weft_fail(err, WEFT_ERR_FORMAT, "%s: wanted the bootloader's .hex file", program->bootloader);
    WEFT_TRY(load_hex(sim->avr, program->bootloader, &base, err));
    WEFT_TRY(check_boot_section(program->bootloader, base, err));
    sim->has_bootloader = true;
    sim->avr->reset_pc = base;
    return WEFT_OK;
}

void weft_controller_sim_wear_out(weft_controller_sim *sim, uint32_t address)
{
    pthread_mutex_lock(&sim->mutex);
    sim->has_worn_cell = true;
    sim->worn_cell = address % (sim->avr->flashend + 1);
    pthread_mutex_unlock(&sim->mutex);
}
