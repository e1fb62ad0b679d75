# firmware/fmu/fmu.mk - the binary that slew sim export puts into a functional
# mock-up unit: the functions of FMI 2.0 and 3.0 around a simulated rig.
#
# It runs in other programs, so it needs little but libc and libm: libyaml is
# linked statically, libcjson (which Debian has as a shared library alone) is packed
# beside it, and nothing but the functions of the standard is exported.

FMU     := $(B)/slew-fmu.so
FMU_SRC := $(wildcard firmware/fmu/*.c)

$(FMU): $(FMU_SRC:%.c=$(B)/%.o) $(LIBS)
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) -s -shared -Wl,-soname,slew-fmu.so \
	    -Wl,--exclude-libs,ALL -Wl,--gc-sections \
	    -Wl,-rpath,'$$ORIGIN' -Wl,--version-script=firmware/fmu/fmu.map \
	    $(if $(SAN),,-Wl$(comma)--no-undefined) $^ -l:libyaml.a -lcjson -lm -o $@

build: $(FMU)
$(B)/tests/firmware/linux/fmu/test_fmu_export: | $(FMU)
