#!/usr/bin/env bash
# keystore.sh FOLDER /ENCLAVE...: a keystore for domain 0 with the files and names that `ros2 security` gives them, by OpenSSL alone.
set -euo pipefail
keystore=$1
shift
mkdir -p "$keystore/enclaves" "$keystore/private" "$keystore/public"
cd "$keystore"

key() { openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1" 2> /dev/null; }
# sign FILE.xml FILE.p7s
sign() { openssl smime -sign -text -in "$1" -out "$2" -signer public/ca.cert.pem -inkey private/ca.key.pem 2> /dev/null; }

key private/ca.key.pem
openssl req -x509 -new -sha256 -days 3650 -key private/ca.key.pem -out public/ca.cert.pem -subj "/CN=sros2CA"
cat > enclaves/governance.xml <<'XML'
<?xml version="1.0" encoding="UTF-8"?>
<dds>
  <domain_access_rules>
    <domain_rule>
      <domains><id>0</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>SIGN</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
XML
sign enclaves/governance.xml enclaves/governance.p7s

topics="<topics><topic>rq/*Request</topic><topic>rr/*Reply</topic><topic>rt/*</topic><topic>ros_discovery_info</topic></topics>"
for enclave in "$@"; do
    folder=enclaves/${enclave#/}
    mkdir -p "$folder"
    key "$folder/key.pem"
    openssl req -new -sha256 -key "$folder/key.pem" -subj "/CN=${enclave//\//\\/}" -out request.pem
    openssl x509 -req -sha256 -days 3650 -in request.pem -CA public/ca.cert.pem -CAkey private/ca.key.pem -CAcreateserial -out "$folder/cert.pem" 2> /dev/null
    cat > "$folder/permissions.xml" <<XML
<?xml version="1.0" encoding="UTF-8"?>
<dds>
  <permissions>
    <grant name="$enclave">
      <subject_name>CN=$enclave</subject_name>
      <validity>
        <not_before>$(date -u -d yesterday +%FT%T)</not_before>
        <not_after>$(date -u -d "next year" +%FT%T)</not_after>
      </validity>
      <allow_rule>
        <domains><id>0</id></domains>
        <publish>$topics</publish>
        <subscribe>$topics</subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
XML
    sign "$folder/permissions.xml" "$folder/permissions.p7s"
    cp enclaves/governance.p7s "$folder/"
    cp public/ca.cert.pem "$folder/identity_ca.cert.pem"
    cp public/ca.cert.pem "$folder/permissions_ca.cert.pem"
done
rm -f request.pem public/ca.cert.srl
