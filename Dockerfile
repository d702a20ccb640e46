# The image of the gateway: docker build -t panelgate .
#
# Debian of a given day. Security updates come by a newer one: take the latest of
# debian:bookworm-YYYYMMDD-slim and build again.
ARG DEBIAN=bookworm-20260824-slim

FROM debian:${DEBIAN} AS build
WORKDIR /src
COPY deploy/install_packages.sh deploy/packages.txt deploy/sbom.sh deploy/
RUN deploy/install_packages.sh build
COPY CMakeLists.txt CMakePresets.json LICENSE ./
COPY config config
COPY deploy/manual deploy/manual
COPY docs docs
COPY include include
COPY src src
RUN cmake --preset release -DPANELGATE_TESTS=OFF -DPANELGATE_UNITY=ON && cmake --build --preset release --target panelgate
RUN DESTDIR=/image cmake --install build/release --prefix /usr --strip && \
    install -D -m 0644 LICENSE /image/usr/share/doc/panelgate/copyright && \
    mkdir -p /image/usr/share/panelgate && \
    deploy/sbom.sh rows libboost1.81-dev libcli11-dev libjs-dygraphs >/image/usr/share/panelgate/built-in.tsv

FROM debian:${DEBIAN}
COPY deploy/install_packages.sh deploy/packages.txt deploy/sbom.sh /tmp/deploy/
RUN /tmp/deploy/install_packages.sh run && rm -rf /var/lib/apt/lists/* /var/cache/apt/* /var/log/*
COPY --from=build /image/ /
# What the service writes; a new volume that is mounted there takes over the owner.
RUN install -d -o 10001 -g 10001 /var/lib/panelgate /var/log/panelgate
# Where events and history are kept, as systemd says it to the service.
ENV STATE_DIRECTORY=/var/lib/panelgate
# What is in here, for scanners: all packages of dpkg, and those that were compiled into the program
RUN cd /usr/share/panelgate && { cat built-in.tsv; /tmp/deploy/sbom.sh rows; } | sort -u | \
    /tmp/deploy/sbom.sh cyclonedx >sbom.cdx.json && rm -r built-in.tsv /tmp/deploy

# docker build --build-arg REVISION=$(git rev-parse HEAD) --build-arg CREATED=$(date -u +%FT%TZ)
ARG DEBIAN
ARG VERSION=1.0.0
ARG REVISION=unknown
ARG CREATED=unknown
LABEL org.opencontainers.image.title="panelgate" \
      org.opencontainers.image.description="Modbus RTU-to-TCP gateway for panels on RS-485 lines" \
      org.opencontainers.image.licenses="MIT" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}" \
      org.opencontainers.image.created="${CREATED}" \
      org.opencontainers.image.base.name="docker.io/library/debian:${DEBIAN}"

# In a container a listener has to be 0.0.0.0:PORT: what is on loopback is reached by nobody outside.
EXPOSE 502 8080
USER 10001:10001
STOPSIGNAL SIGTERM
# Asks where /etc/panelgate/panelgate.yaml says, or on 8080. Needs no shell.
HEALTHCHECK --interval=10s --timeout=3s --start-period=5s --retries=3 CMD ["panelgate", "health"]
ENTRYPOINT ["panelgate"]
CMD ["run"]
