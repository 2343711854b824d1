// A Fast DDS participant beside our nodes: hears or says std_msgs/String on /text.
//
//   fastdds_peer hear ENCLAVE_FOLDER|-    a line with the length of each text that arrives, until standard input ends
//   fastdds_peer say  ENCLAVE_FOLDER|-    once it has a reader: texts of 3, 7, 11, ... 159 letters, then waits for standard input's end
//
// "-" talks in the clear. g++ -std=c++17 fastdds_peer.cpp -lfastrtps -lfastcdr, with Debian's libfastrtps-dev (2.9, which has the security plugins).
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

// std_msgs/msg/String in CDR: four bytes of encapsulation, the length with the closing zero, the letters.
struct TextType : TopicDataType {
    TextType() {
        setName("std_msgs::msg::dds_::String_");
        m_typeSize = 1024;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const auto& text = *static_cast<std::string*>(data);
        const unsigned char encapsulation[4] = {0, 1, 0, 0};
        const uint32_t length = text.size() + 1;
        std::memcpy(payload->data, encapsulation, 4);
        std::memcpy(payload->data + 4, &length, 4);
        std::memcpy(payload->data + 8, text.c_str(), length);
        payload->length = 8 + length;
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        uint32_t length = 0;
        if (payload->length < 9) return false;
        std::memcpy(&length, payload->data + 4, 4);
        if (length == 0 || 8 + length > payload->length) return false;
        static_cast<std::string*>(data)->assign(reinterpret_cast<char*>(payload->data) + 8, length - 1);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return uint32_t(static_cast<std::string*>(data)->size()) + 9; };
    }
    void* createData() override { return new std::string; }
    void deleteData(void* data) override { delete static_cast<std::string*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

// As rmw_fastrtps sets it from an enclave of a keystore.
static void secure(DomainParticipantQos& qos, const std::string& enclave) {
    const auto file = [&](const char* name) { return "file://" + enclave + "/" + name; };
    auto& properties = qos.properties().properties();
    const auto set = [&](const std::string& name, const std::string& value) { properties.emplace_back(name, value); };
    set("dds.sec.auth.plugin", "builtin.PKI-DH");
    set("dds.sec.auth.builtin.PKI-DH.identity_ca", file("identity_ca.cert.pem"));
    set("dds.sec.auth.builtin.PKI-DH.identity_certificate", file("cert.pem"));
    set("dds.sec.auth.builtin.PKI-DH.private_key", file("key.pem"));
    set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
    set("dds.sec.access.plugin", "builtin.Access-Permissions");
    set("dds.sec.access.builtin.Access-Permissions.permissions_ca", file("permissions_ca.cert.pem"));
    set("dds.sec.access.builtin.Access-Permissions.governance", file("governance.p7s"));
    set("dds.sec.access.builtin.Access-Permissions.permissions", file("permissions.p7s"));
}

struct Hearing : DataReaderListener {
    void on_data_available(DataReader* reader) override {
        std::string text;
        SampleInfo info;
        while (reader->take_next_sample(&text, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data) std::cout << text.size() << std::endl;
    }
};

static int fails(const char* what) {
    std::cerr << "fastdds_peer: no " << what << std::endl;
    return 1;
}

int main(int count, char** arguments) {
    if (count != 3) return fails("two arguments: hear|say ENCLAVE_FOLDER|-");
    const bool says = std::strcmp(arguments[1], "say") == 0;
    DomainParticipantQos qos;
    if (std::strcmp(arguments[2], "-") != 0) secure(qos, arguments[2]);
    auto* participant = DomainParticipantFactory::get_instance()->create_participant(0, qos);
    if (!participant) return fails("participant");
    TypeSupport type(new TextType);
    type.register_type(participant);
    auto* topic = participant->create_topic("rt/text", type.get_type_name(), TOPIC_QOS_DEFAULT);
    if (!topic) return fails("topic");
    Hearing hearing;
    if (says) {
        auto writer_qos = DATAWRITER_QOS_DEFAULT;
        writer_qos.history().kind = KEEP_ALL_HISTORY_QOS;
        auto* writer = participant->create_publisher(PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, writer_qos);
        if (!writer) return fails("writer");
        PublicationMatchedStatus matched;
        while (writer->get_publication_matched_status(matched), matched.current_count == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        std::this_thread::sleep_for(std::chrono::milliseconds(500));
        for (int length = 3; length < 160; length += 4) {
            std::string text(length, 'x');
            writer->write(&text);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    } else {
        auto reader_qos = DATAREADER_QOS_DEFAULT;
        reader_qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        reader_qos.history().kind = KEEP_ALL_HISTORY_QOS;
        if (!participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(topic, reader_qos, &hearing))
            return fails("reader");
    }
    while (std::getchar() != EOF) {}
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
    return 0;
}
