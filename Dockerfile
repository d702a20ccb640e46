FROM debian:bookworm-slim AS build
WORKDIR /src
COPY deploy/install_packages.sh deploy/packages.txt deploy/
RUN deploy/install_packages.sh build
COPY CMakeLists.txt CMakePresets.json ./
COPY config config
COPY include include
COPY src src
RUN cmake --preset release -DPANELGATE_TESTS=OFF && cmake --build --preset release --target panelgate

FROM debian:bookworm-slim
COPY deploy/install_packages.sh deploy/packages.txt /tmp/deploy/
RUN /tmp/deploy/install_packages.sh run && rm -rf /tmp/deploy /var/lib/apt/lists/* /var/cache/apt/*
COPY --from=build /src/build/release/panelgate /usr/bin/panelgate
EXPOSE 502 8080
USER 10001:10001
ENTRYPOINT ["panelgate"]
CMD ["run"]
