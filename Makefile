# Builds, tests and runs lightprobe. `make help` lists what to ask for.
#
#   CONFIG    release | debug | sanitize | tsan       one folder each: build/<CONFIG>
#   COMPILER  gcc | clang                             clang builds in build/<CONFIG>-clang

CONFIG   ?= release
COMPILER ?= gcc
PREFIX   ?= /usr/local
DESTDIR  ?=
DATA     ?= data
PORT     ?= 8080
PYTHON   ?= python3

.DEFAULT_GOAL := all
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

# ---- compilers and flags -------------------------------------------------------------------------

CC_gcc := gcc
CC_clang := clang
CXX_gcc := g++
CXX_clang := clang++
ifeq ($(CC_$(COMPILER)),)
$(error COMPILER is gcc or clang, not "$(COMPILER)")
endif
CC  := $(CC_$(COMPILER))
CXX := $(CXX_$(COMPILER))
B   := build/$(CONFIG)$(if $(filter clang,$(COMPILER)),-clang)

OPT_release  := -O2 -g
OPT_debug    := -Og -g3
OPT_sanitize := -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
OPT_tsan     := -O1 -g -fno-omit-frame-pointer -fsanitize=thread
ifeq ($(OPT_$(CONFIG)),)
$(error CONFIG is release, debug, sanitize or tsan, not "$(CONFIG)")
endif
LINK_FLAGS := $(filter -fsanitize% -fno-sanitize%,$(OPT_$(CONFIG)))

WARN := -Wall -Wextra -Wshadow -Wvla -Wformat=2 -Wundef
WARN_C := $(WARN) -Wconversion -Wmissing-prototypes -Wstrict-prototypes
WERROR ?= -Werror
# The film's bits must not depend on the compiler: no contraction, no relaxed arithmetic.
BITS := -ffp-contract=off -fno-fast-math
COMMON := -I. -D_GNU_SOURCE -pthread -fstack-protector-strong $(OPT_$(CONFIG)) $(BITS)
CFLAGS   := -std=c17 $(COMMON) $(WARN_C) $(WERROR)
# vptr checks would need the C++ run-time of the sanitizer, which a C link has not.
CXXFLAGS := -std=c++17 $(COMMON) $(WARN) $(WERROR) $(if $(filter sanitize,$(CONFIG)),-fno-sanitize=vptr)

# Asked of pkg-config only when something is built, and once.
PKGS_engine  := nettle libxxhash
PKGS_shim    := OpenImageIO
PKGS_protocol := libcjson
PKGS_server  := libmicrohttpd libuv
PKGS_lpc     := libcurl nettle
pkg-cflags = $(shell pkg-config --cflags $(1) 2>/dev/null | sed 's/-I/-isystem /g')
pkg-libs   = $(shell pkg-config --libs $(1) 2>/dev/null)
LIBS_engine   = $(call pkg-libs,$(PKGS_engine)) $(call pkg-libs,$(PKGS_shim)) -lstdc++ -lm
LIBS_protocol = $(call pkg-libs,$(PKGS_protocol)) -lm
LIBS_server   = $(call pkg-libs,$(PKGS_server))
LIBS_lpc      = $(call pkg-libs,$(PKGS_lpc))

# ---- what there is -------------------------------------------------------------------------------

objects = $(patsubst %,$(B)/obj/%.o,$(1))
ENGINE   := $(call objects,$(wildcard engine/*.c engine/*.cpp))
PROTOCOL := $(call objects,$(wildcard protocol/*.c))
SERVER   := $(call objects,$(wildcard server/*.c))
LPC      := $(call objects,$(wildcard clients/c/*.c))
CLI      := $(call objects,$(wildcard clients/cli/*.c))
HARNESS  := $(call objects,$(wildcard tests/harness/*.c))
# Everything but main(): what unit tests may link.
SERVER_PARTS := $(filter-out $(B)/obj/server/main.c.o,$(SERVER))
CLI_PARTS    := $(filter-out $(B)/obj/clients/cli/main.c.o,$(CLI))
UNIT_SOURCES := $(wildcard tests/engine/test_*.c tests/protocol/test_*.c tests/server/test_*.c tests/clients/test_*.c)
UNITS := $(patsubst tests/%.c,$(B)/tests/%,$(UNIT_SOURCES))
HEADERS := $(wildcard engine/*.h protocol/*.h server/*.h clients/*/*.h tests/harness/*.h)

PROGRAMS := $(B)/lightprobed $(B)/lightprobe

.PHONY: all units programs
all: programs
ifeq ($(CONFIG)$(COMPILER),releasegcc)
programs: build/lightprobed build/lightprobe
build/lightprobed build/lightprobe: build/%: build/release/%
	@ln -sfn release/$* $@
else
programs: $(PROGRAMS)
endif
units: $(UNITS)

# ---- compiling -----------------------------------------------------------------------------------

$(B)/obj/engine/%.c.o:   CPPFLAGS = $(call pkg-cflags,$(PKGS_engine))
$(B)/obj/engine/%.cpp.o: CPPFLAGS = $(call pkg-cflags,$(PKGS_shim))
$(B)/obj/protocol/%.c.o: CPPFLAGS = $(call pkg-cflags,$(PKGS_protocol))
$(B)/obj/server/%.c.o:   CPPFLAGS = $(call pkg-cflags,$(PKGS_server))
$(B)/obj/clients/c/%.c.o: CPPFLAGS = $(call pkg-cflags,$(PKGS_lpc))

# V=1 shows the commands.
Q := $(if $(V),,@)
say = @$(if $(V),true,printf '  %-4s %s\n' $(1) $@)

$(B)/obj/%.c.o: %.c Makefile
	@mkdir -p $(@D)
	$(call say,CC)
	$(Q)$(CC) $(CFLAGS) $(CPPFLAGS) -MMD -MP -c $< -o $@

$(B)/obj/%.cpp.o: %.cpp Makefile
	@mkdir -p $(@D)
	$(call say,CXX)
	$(Q)$(CXX) $(CXXFLAGS) $(CPPFLAGS) -MMD -MP -c $< -o $@

# Archives are made anew, so that a removed file leaves no object behind.
define archive
@mkdir -p $(@D)
@rm -f $@
$(call say,AR)
$(Q)ar rcs $@ $^
endef
$(B)/libengine.a: $(ENGINE)
	$(archive)
$(B)/libprotocol.a: $(PROTOCOL)
	$(archive)
$(B)/liblpc.a: $(LPC)
	$(archive)
$(B)/libserver_parts.a: $(SERVER_PARTS)
	$(archive)
$(B)/libcli_parts.a: $(CLI_PARTS)
	$(archive)

LINK = $(Q)$(CC) -pthread $(LINK_FLAGS) -Wl,--as-needed

# The link line of a program shows its layers.
$(B)/lightprobed: $(SERVER) $(B)/libengine.a $(B)/libprotocol.a
	$(call say,LINK)
	$(LINK) -o $@ $^ $(LIBS_server) $(LIBS_engine) $(LIBS_protocol)
# server/bake.c is where protocol and engine meet: no sockets, no threads; the command line shares it.
$(B)/lightprobe: $(CLI) $(B)/obj/server/bake.c.o $(B)/liblpc.a $(B)/libengine.a $(B)/libprotocol.a
	$(call say,LINK)
	$(LINK) -o $@ $^ $(LIBS_lpc) $(LIBS_engine) $(LIBS_protocol)

$(B)/tests/%: $(B)/obj/tests/%.c.o $(HARNESS) $(B)/libcli_parts.a $(B)/libserver_parts.a $(B)/liblpc.a $(B)/libengine.a $(B)/libprotocol.a
	@mkdir -p $(@D)
	$(call say,LINK)
	$(LINK) -o $@ $^ $(LIBS_server) $(LIBS_lpc) $(LIBS_engine) $(LIBS_protocol)

# This one starts the program as its users do.
$(B)/tests/clients/test_commands: | $(B)/lightprobe

.SECONDARY:
-include $(shell find $(B)/obj -name '*.d' 2>/dev/null)

# ---- for people ----------------------------------------------------------------------------------

.PHONY: help setup demo serve test check-style golden picture install clean

help: ## this list
	@echo 'make TARGET [CONFIG=release|debug|sanitize|tsan] [COMPILER=gcc|clang]'
	@echo
	@echo '  all          (the default) build/lightprobed and build/lightprobe'
	@awk -F ':[^#]*## ' '/^[a-z-]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' Makefile
	@echo '  units        the unit tests of CONFIG, in build/CONFIG/tests; start them in this folder'

setup: ## install the Debian packages that are missing (asks for root only then)
	@deploy/setup.sh --test

demo: ## bake a probe of a real terrain through the daemon; ends by itself
	@DATA='$(DATA)' deploy/demo.sh

serve: ## build, fetch a terrain, run the daemon on PORT (8080) until Ctrl-C
	@DATA='$(DATA)' PORT='$(PORT)' deploy/serve.sh

test: ## everything that is checked: style, units, the daemon over HTTP, sanitizers, two compilers
	@deploy/setup.sh --test
	@$(PYTHON) tests/run

check-style: ## layers, headers, format, sizes
	@$(PYTHON) tests/style/check.py

golden: all ## renew the golden images of tests/golden (look at them, and say why in the commit)
	@$(PYTHON) tests/e2e/test_golden.py --renew

picture: all ## make the README's picture anew (tests/gallery/arizonachase.png)
	deploy/rally-scenes.sh --data '$(DATA)' --depth 11 arizonachase
	build/lightprobe render '$(DATA)'/scenes/arizonachase.lps \
	    --request tests/gallery/arizonachase.json --format png -o build/gallery
	cp build/gallery/arizonachase.png tests/gallery/arizonachase.png

install: all ## copy both programs below PREFIX (/usr/local), or DESTDIR/PREFIX
	install -d '$(DESTDIR)$(PREFIX)/bin'
	install -m 755 $(PROGRAMS) '$(DESTDIR)$(PREFIX)/bin'

clean: ## remove what was built; scenes and results in DATA stay
	rm -rf build
